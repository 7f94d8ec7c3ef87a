#include "math/constants.glsl"
#include "math/cospow.glsl"
#include "surface/frame.glsl"

// The model of Blinn 1977, normalised as in Giesen 2009: (kd/pi + ks c(p) max(n.h, 0)^p) n.l with
// c(p) = (p + 2)(p + 4) / (8 pi (2^(-p/2) + p)), so that the lobe's albedo at normal incidence is ks. p is the exponent.
struct BlinnPhongNormalised {
    vec3 kd;
    vec3 ks;
    float exponent;
};

vec3 brdf_cos(BlinnPhongNormalised m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    float NoV = dot(f.n, v);
    vec3 H = l + v;
    // Below 1e-12, |H|^2 is only a rounding error: l is -v, and there is no half vector.
    float H2 = dot(H, H);
    // The square root of the lobe is squared last: its tail would be flushed to 0 before the factor in p makes it large again.
    float root = H2 > 1e-12 ? cospow(f.n, H * inversesqrt(max(H2, 1e-12)), 0.5 * m.exponent) : 0.0;
    float p = m.exponent;
    float lobe = (p + 2.0) * ((p + 4.0) / (8.0 * (exp2(-0.5 * p) + p))) * root * root;
    float lit = NoL > 0.0 && NoV > 0.0 ? INV_PI * NoL : 0.0;
    return m.kd * lit + m.ks * (lit * lobe);
}

vec3 ambient_reflectance(BlinnPhongNormalised m) {
    return m.kd;
}
