#include "lib/constants.glsl"
#include "lib/cospow.glsl"
#include "lib/frame.glsl"

// Lafortune and Willems 1994: (kd/pi + ks (p + 2)/(2 pi) max(r.v, 0)^p) n.l, r the mirror direction of l.
struct PhongNormalised {
    vec3 kd;
    vec3 ks;
    float exponent;
};

vec3 brdf_cos(PhongNormalised m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    float NoV = dot(f.n, v);
    // The lobe's root, squared in the end: its tail would vanish below FLT_MIN before p makes it large again.
    float root = cospow(2.0 * NoV * f.n - v, l, 0.5 * m.exponent);
    float lobe = (0.5 * m.exponent + 1.0) * root * root;
    float lit = NoL > 0.0 && NoV > 0.0 ? INV_PI * NoL : 0.0;
    return m.kd * lit + m.ks * (lit * lobe);
}

vec3 ambient_reflectance(PhongNormalised m) {
    return m.kd;
}
