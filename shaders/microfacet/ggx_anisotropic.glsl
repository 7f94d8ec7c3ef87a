#include "math/constants.glsl"
#include "surface/frame.glsl"
#include "microfacet/microfacet_alpha.glsl"

// Anisotropic GGX: its distribution D of microfacet normals times V n.l [1/sr]. V = G2 / (4 n.l n.v), and G2 is Smith's
// height-correlated shadowing (Burley 2012, eq. 13; Heitz 2014, eq. 99). alpha_x = alpha / aspect and alpha_y = alpha aspect
// with aspect = sqrt(1 - 0.9 anisotropy), for anisotropy in [0, 1]: highlights are longer along the tangent.
// h is (l + v) / |l + v|. The result is finite for any l, v and h; the caller excludes directions below the horizon. The
// function includes n.l, because V alone overflows where both directions graze.
float ggx_cos(Frame f, vec3 l, vec3 v, vec3 h, float roughness, float anisotropy) {
    float a = microfacet_alpha(roughness);
    float aspect = sqrt(1.0 - 0.9 * anisotropy);
    float ax = a / aspect;
    float ay = a * aspect;
    // q = (h.t / ax)^2 + (h.b / ay)^2 + (h.n)^2, computed from h - n, which is exact for nearly equal vectors and has the same
    // products with t and b, since both are perpendicular to n.
    vec3 d = h - f.n;
    float NoH = 1.0 - 0.5 * dot(d, d);
    vec3 x = vec3(dot(f.t, d) / ax, dot(f.b, d) / ay, NoH);
    float q = dot(x, x);
    vec3 xl = vec3(ax * dot(f.t, l), ay * dot(f.b, l), dot(f.n, l));
    vec3 xv = vec3(ax * dot(f.t, v), ay * dot(f.b, v), dot(f.n, v));
    float g = xl.z * length(xv) + xv.z * length(xl);
    return 0.5 * INV_PI / (a * a * q * q) * (xl.z / max(g, FLT_MIN));
}
