#include "lib/constants.glsl"
#include "lib/frame.glsl"
#include "lobe/gtr2.glsl"

// Burley 2012, sections 5.4 and 5.6: D G / (4 n.l n.v) of the base layer, times n.l; alpha_x = roughness^2 / aspect and
// alpha_y = roughness^2 aspect, aspect = sqrt(1 - 0.9 anisotropy). Its shadowing does not see the tangents.
float gtr2_cos(Frame f, vec3 h, float NoL, float NoV, float roughness, float anisotropy) {
    float aspect = sqrt(1.0 - 0.9 * anisotropy);
    float a = roughness * roughness;
    float ax = max(LEAST_ALPHA, a / aspect);
    float ay = max(LEAST_ALPHA, a * aspect);
    // (h.t / alpha_x)^2 + (h.b / alpha_y)^2 + (n.h)^2. h - n is exact for near vectors, and t and b are perpendicular to n.
    vec3 d = h - f.n;
    vec3 x = vec3(dot(f.t, d) / ax, dot(f.b, d) / ay, 1.0 - 0.5 * dot(d, d));
    float q = dot(x, x);
    return INV_PI / (ax * ay * q * q) * gtr2_visible(NoL, NoV, roughness) * NoL;
}
