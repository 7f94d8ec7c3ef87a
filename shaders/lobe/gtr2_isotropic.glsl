#include "math/constants.glsl"
#include "surface/frame.glsl"
#include "lobe/gtr2.glsl"

// The isotropic base layer of Burley 2012, sections 5.4 and 5.6: distribution D and shadowing G give D G / (4 n.l n.v), times
// n.l, with alpha = roughness^2. The argument anisotropy is not used.
float gtr2_cos(Frame f, vec3 h, float NoL, float NoV, float roughness, float anisotropy) {
    float a = max(LEAST_ALPHA, roughness * roughness);
    float a2 = a * a;
    // q = alpha^2 cos^2 + sin^2 of the angle between n and h. sin^2 comes from h - n, which is exact for nearly equal vectors.
    vec3 d = h - f.n;
    float s = 0.5 * dot(d, d);
    float q = a2 + (1.0 - a2) * (s * (2.0 - s));
    return INV_PI * a2 / (q * q) * gtr2_visible(NoL, NoV, roughness) * NoL;
}
