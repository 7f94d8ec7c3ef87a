#include "lib/constants.glsl"
#include "lib/frame.glsl"
#include "lobe/gtr2.glsl"

// Burley 2012, sections 5.4 and 5.6: D G / (4 n.l n.v) of the base layer, times n.l, for alpha = roughness^2.
// anisotropy is not looked at.
float gtr2_cos(Frame f, vec3 h, float NoL, float NoV, float roughness, float anisotropy) {
    float a = max(LEAST_ALPHA, roughness * roughness);
    float a2 = a * a;
    // alpha^2 cos^2 + sin^2; sin^2 from h - n, of near vectors exact.
    vec3 d = h - f.n;
    float s = 0.5 * dot(d, d);
    float q = a2 + (1.0 - a2) * (s * (2.0 - s));
    return INV_PI * a2 / (q * q) * gtr2_visible(NoL, NoV, roughness) * NoL;
}
