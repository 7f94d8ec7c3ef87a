#include "math/constants.glsl"
#include "optics/f_schlick.glsl"
#include "surface/frame.glsl"
#include "math/log1m.glsl"

// The model of Ashikhmin and Shirley 2000, eqs. 1-5, times n.l. The exponent has (h.u)^2 and (h.v)^2, as in the paper, with the
// tangent u and the bitangent v. Lecture slide 42 writes n in place of h there, which would make the exponent 0 (erratum).
struct AshikhminShirley {
    vec3 kd;
    vec3 ks;
    float pu;
    float pv;
};

vec3 brdf_cos(AshikhminShirley m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    float NoV = dot(f.n, v);
    vec3 H = l + v;
    float H2 = dot(H, H);
    float inverse_H = inversesqrt(max(H2, 1e-12));
    float LoH = min(0.5 * H2 * inverse_H, 1.0);  // l.h = |H| / 2
    // H.u and H.v are squared before they are divided by |H|^2. The lobe is sensitive to every rounding of its exponent, and
    // this order has fewer roundings than h.u and h.v.
    float Hu = dot(f.t, H);
    float Hv = dot(f.b, H);
    float Hu2 = Hu * Hu;
    float Hv2 = Hv * Hv;
    // The lobe is (n.h)^((pu hu^2 + pv hv^2) / (1 - (n.h)^2)). With sin^2 = hu^2 + hv^2 and log(n.h) = log(1 - sin^2) / 2, the
    // quotient log(n.h) / sin^2 is finite at h = n. Above sin^2 = 1/4 the plain logarithm is precise.
    float sin2 = (Hu2 + Hv2) / H2;
    float NoH = (NoL + NoV) * inverse_H;
    float log_ratio = sin2 < 0.25 ? 0.5 * log1m_over(sin2) : log(NoH) / sin2;
    float lobe = exp((m.pu * Hu2 + m.pv * Hv2) / H2 * log_ratio);
    float norm = sqrt(m.pu + 1.0) * sqrt(m.pv + 1.0) * (0.125 * INV_PI);
    float specular = norm * lobe * NoL / (LoH * max(NoL, NoV));
    // dl and dv are 1 - (1 - x/2)^5 for x = n.l and n.v, in factored form, so that small cosines keep their digits.
    float a = 1.0 - 0.5 * NoL;
    float b = 1.0 - 0.5 * NoV;
    float dl = 0.5 * NoL * (1.0 + a * (1.0 + a * (1.0 + a * (1.0 + a))));
    float dv = 0.5 * NoV * (1.0 + b * (1.0 + b * (1.0 + b * (1.0 + b))));
    float diffuse = 28.0 / 23.0 * INV_PI * dl * dv * NoL;
    // Below 1e-12, |H|^2 is only a rounding error: l is -v, and there is no half vector. The conditions below also drop infinities and
    // NaN.
    bool lit = NoL > 0.0 && NoV > 0.0;
    return m.kd * (1.0 - m.ks) * (lit ? diffuse : 0.0) + f_schlick(m.ks, LoH) * (lit && H2 > 1e-12 ? specular : 0.0);
}

vec3 ambient_reflectance(AshikhminShirley m) {
    return m.kd;
}
