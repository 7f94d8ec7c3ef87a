#include "math/constants.glsl"
#include "math/cospow.glsl"
#include "surface/frame.glsl"

// The normalised Phong model of Lafortune and Willems 1994: (kd/pi + ks (p + 2)/(2 pi) max(r.v, 0)^p) n.l, where r is l
// mirrored at n and p is the exponent.
struct PhongNormalised {
    vec3 kd;
    vec3 ks;
    float exponent;
};

vec3 brdf_cos(PhongNormalised m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    float NoV = dot(f.n, v);
    // The square root of the lobe is squared last: its tail would be flushed to 0 before the factor in p makes it large again.
    float root = cospow(2.0 * NoV * f.n - v, l, 0.5 * m.exponent);
    float lobe = (0.5 * m.exponent + 1.0) * root * root;
    float lit = NoL > 0.0 && NoV > 0.0 ? INV_PI * NoL : 0.0;
    return m.kd * lit + m.ks * (lit * lobe);
}

vec3 ambient_reflectance(PhongNormalised m) {
    return m.kd;
}
