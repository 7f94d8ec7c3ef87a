#include "math/cos_half.glsl"
#include "surface/frame.glsl"
#include "optics/f_schlick.glsl"
#include "microfacet/ggx_isotropic.glsl"
#include <diffuse>

// The retroreflective model of Belcour et al. 2014, eq. 3, over a diffuse base: GGX with the back vector K = r + v in place of
// l + v, where r is l mirrored at n. It reflects light back to where it came from.
struct RetroGgx {
    vec3 kd;
    vec3 ks;
    float roughness;
};

vec3 brdf_cos(RetroGgx m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    float NoV = dot(f.n, v);
    vec3 r = 2.0 * NoL * f.n - l;
    vec3 K = r + v;
    float K2 = dot(K, K);
    float length_K = sqrt(K2);
    vec3 k = K / max(length_K, 1e-6);
    float RoK = cos_half(r, v, length_K);
    float specular = ggx_cos(f, r, v, k, m.roughness, 0.0);
    // Below 1e-12, |K|^2 is only a rounding error: l is v and lies in the surface, and there is no back vector.
    bool lit = NoL > 0.0 && NoV > 0.0;
    return diffuse(m.kd, m.ks, lit ? NoL : 0.0, max(NoV, 0.0)) + f_schlick(m.ks, RoK) * (lit && K2 > 1e-12 ? specular : 0.0);
}

vec3 ambient_reflectance(RetroGgx m) {
    return m.kd;
}
