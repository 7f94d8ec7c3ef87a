#include "math/cos_half.glsl"
#include "surface/frame.glsl"
#include "microfacet/beckmann.glsl"
#include "microfacet/microfacet_alpha.glsl"
#include <geometry>
#include <fresnel>
#include <diffuse>

// The model of Cook and Torrance 1982 with Beckmann's distribution D, Fresnel term F and shadowing G: F D G/(4 n.v), over a
// diffuse base. The paper divides by pi in place of 4 and has no pi in D, which makes it four times as large. Walter et al.
// 2007, eq. 20, derive the 4.
struct Beckmann {
    vec3 kd;
    vec3 eta;
    vec3 k;
    float roughness;
};

vec3 brdf_cos(Beckmann m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    float NoV = dot(f.n, v);
    vec3 H = l + v;
    float H2 = dot(H, H);
    float length_H = sqrt(H2);
    float LoH = cos_half(l, v, length_H);
    float divisor = max(length_H, 1e-6);
    vec3 h = H / divisor;
    float NoH = (NoL + NoV) / divisor;
    float alpha = microfacet_alpha(m.roughness);
    float specular = d_beckmann(f.n, h, NoH, alpha, visible(NoL, NoV, H2, NoH, alpha));
    // Below 1e-12, |H|^2 is only a rounding error: l is -v, and there is no half vector. The conditions below also drop infinities and
    // NaN.
    bool lit = NoL > 0.0 && NoV > 0.0;
    return diffuse(m.kd, m.eta, m.k, lit ? NoL : 0.0, max(NoV, 0.0)) +
           fresnel(m.eta, m.k, LoH) * (lit && H2 > 1e-12 ? specular : 0.0);
}

vec3 ambient_reflectance(Beckmann m) {
    return m.kd;
}
