#include "lib/cos_half.glsl"
#include "lib/frame.glsl"
#include "lib/fresnel.glsl"
#include "microfacet/ggx_isotropic.glsl"
#include <diffuse>

// Belcour et al. 2014, eq. 3: GGX about the back vector K = r + v, r the mirror direction of l, in place of l + v. Light goes
// back where it came from. Over a diffuse base.
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
    // |K|^2 below 1e-12: l = v in the horizon to rounding, where no back vector is.
    bool lit = NoL > 0.0 && NoV > 0.0;
    return diffuse(m.kd, m.ks, lit ? NoL : 0.0, max(NoV, 0.0)) + f_schlick(m.ks, RoK) * (lit && K2 > 1e-12 ? specular : 0.0);
}

vec3 ambient_reflectance(RetroGgx m) {
    return m.kd;
}
