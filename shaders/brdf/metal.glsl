#include "lib/cos_half.glsl"
#include "lib/f0_conductor.glsl"
#include "lib/frame.glsl"
#include <ggx>
#include <fresnel>

// F D V n.l: a rough conductor of index eta + i k; D V as in microfacet/ggx_*.glsl.
struct Metal {
    vec3 eta;
    vec3 k;
    float roughness;
    float anisotropy;
};

vec3 brdf_cos(Metal m, Frame f, vec3 l, vec3 v) {
    vec3 H = l + v;
    float H2 = dot(H, H);
    float length_H = sqrt(H2);
    vec3 h = H / max(length_H, 1e-6);
    float LoH = cos_half(l, v, length_H);
    float specular = ggx_cos(f, l, v, h, m.roughness, m.anisotropy);
    // |H|^2 below 1e-12: l = -v to rounding, where no half vector is.
    bool lit = dot(f.n, l) > 0.0 && dot(f.n, v) > 0.0 && H2 > 1e-12;
    return fresnel(m.eta, m.k, LoH) * (lit ? specular : 0.0);
}

vec3 ambient_reflectance(Metal m) {
    return f0_conductor(m.eta, m.k);
}
