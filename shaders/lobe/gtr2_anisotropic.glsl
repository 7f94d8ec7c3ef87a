#include "math/constants.glsl"
#include "surface/frame.glsl"
#include "lobe/gtr2.glsl"

// The anisotropic base layer of Burley 2012, sections 5.4 and 5.6: distribution D and shadowing G give D G / (4 n.l n.v), times
// n.l. alpha_x = roughness^2 / aspect and alpha_y = roughness^2 aspect with aspect = sqrt(1 - 0.9 anisotropy). The shadowing G
// is isotropic.
float gtr2_cos(Frame f, vec3 h, float NoL, float NoV, float roughness, float anisotropy) {
    float aspect = sqrt(1.0 - 0.9 * anisotropy);
    float a = roughness * roughness;
    float ax = max(LEAST_ALPHA, a / aspect);
    float ay = max(LEAST_ALPHA, a * aspect);
    // q = (h.t / alpha_x)^2 + (h.b / alpha_y)^2 + (n.h)^2, computed from h - n, which is exact for nearly equal vectors and has
    // the same products with t and b, since both are perpendicular to n.
    vec3 d = h - f.n;
    vec3 x = vec3(dot(f.t, d) / ax, dot(f.b, d) / ay, 1.0 - 0.5 * dot(d, d));
    float q = dot(x, x);
    return INV_PI / (ax * ay * q * q) * gtr2_visible(NoL, NoV, roughness) * NoL;
}
