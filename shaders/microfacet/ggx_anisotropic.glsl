#include "lib/constants.glsl"
#include "lib/frame.glsl"
#include "microfacet/microfacet_alpha.glsl"

// GGX with a width along each tangent direction: D V n.l [1/sr], V = G2 / (4 n.l n.v), G2 Smith's, height-correlated
// (Burley 2012, eq. 13; Heitz 2014, eq. 99). alpha_x = alpha / aspect and alpha_y = alpha aspect,
// aspect = sqrt(1 - 0.9 anisotropy): highlights are longer along the tangent. anisotropy in [0, 1].
// h: (l + v) / |l + v|. Finite for any l, v, h; what is below the horizon is for the caller to leave out.
// The cosine is in it because V alone overflows where both directions graze.
float ggx_cos(Frame f, vec3 l, vec3 v, vec3 h, float roughness, float anisotropy) {
    float a = microfacet_alpha(roughness);
    float aspect = sqrt(1.0 - 0.9 * anisotropy);
    float ax = a / aspect;
    float ay = a * aspect;
    // (h.t / ax)^2 + (h.b / ay)^2 + (h.n)^2. h - n is exact for near vectors, and t and b are perpendicular to n.
    vec3 d = h - f.n;
    float NoH = 1.0 - 0.5 * dot(d, d);
    vec3 x = vec3(dot(f.t, d) / ax, dot(f.b, d) / ay, NoH);
    float q = dot(x, x);
    vec3 xl = vec3(ax * dot(f.t, l), ay * dot(f.b, l), dot(f.n, l));
    vec3 xv = vec3(ax * dot(f.t, v), ay * dot(f.b, v), dot(f.n, v));
    float g = xl.z * length(xv) + xv.z * length(xl);
    return 0.5 * INV_PI / (a * a * q * q) * (xl.z / max(g, FLT_MIN));
}
