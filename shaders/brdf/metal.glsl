#include "math/cos_half.glsl"
#include "optics/f0_conductor.glsl"
#include "surface/frame.glsl"
#include <ggx>
#include <fresnel>

// A rough conductor with the refractive index eta + i k: the Fresnel term F times D V n.l. microfacet/ggx_*.glsl have D V n.l.
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
    // Below 1e-12, |H|^2 is only a rounding error: l is -v, and there is no half vector.
    bool lit = dot(f.n, l) > 0.0 && dot(f.n, v) > 0.0 && H2 > 1e-12;
    return fresnel(m.eta, m.k, LoH) * (lit ? specular : 0.0);
}

vec3 ambient_reflectance(Metal m) {
    return f0_conductor(m.eta, m.k);
}
