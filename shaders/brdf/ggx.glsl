#include "math/cos_half.glsl"
#include "surface/frame.glsl"
#include "optics/f_schlick.glsl"
#include <ggx>
#include <diffuse>

// The model of glTF 2.0, appendix B: kd (1 - metallic)/pi (1 - F) n.l + F D V n.l. F is Schlick's Fresnel term with the value
// mix(f0, kd, metallic) at normal incidence, and microfacet/ggx_*.glsl have D V n.l.
struct Ggx {
    vec3 kd;
    vec3 f0;
    float metallic;
    float roughness;
    float anisotropy;
};

vec3 brdf_cos(Ggx m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    float NoV = dot(f.n, v);
    vec3 H = l + v;
    float H2 = dot(H, H);
    float length_H = sqrt(H2);
    vec3 h = H / max(length_H, 1e-6);
    float LoH = cos_half(l, v, length_H);
    vec3 f0 = mix(m.f0, m.kd, m.metallic);
    float specular = ggx_cos(f, l, v, h, m.roughness, m.anisotropy);
    // Below 1e-12, |H|^2 is only a rounding error: l is -v, and there is no half vector.
    bool lit = NoL > 0.0 && NoV > 0.0;
    return diffuse(m.kd * (1.0 - m.metallic), f0, LoH, lit ? NoL : 0.0) +
           f_schlick(f0, LoH) * (lit && H2 > 1e-12 ? specular : 0.0);
}

vec3 ambient_reflectance(Ggx m) {
    return m.kd;
}
