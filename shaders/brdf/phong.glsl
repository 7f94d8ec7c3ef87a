#include "lib/constants.glsl"
#include "lib/cospow.glsl"
#include "lib/frame.glsl"

// Phong 1975; lecture slides 17-24: (kd n.l + ks max(r.v, 0)^exponent) / pi, r the mirror direction of l.
// Slides 18 and 24 let light from behind leak through r.v > 0; here it is 0 (erratum).
struct Phong {
    vec3 kd;
    vec3 ks;
    float exponent;
    vec3 ka;
};

vec3 brdf_cos(Phong m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    float NoV = dot(f.n, v);
    // r.v = l.(mirror of v), and that mirror is the same for every light.
    float lobe = cospow(2.0 * NoV * f.n - v, l, m.exponent);
    float lit = NoL > 0.0 && NoV > 0.0 ? INV_PI : 0.0;
    return m.kd * (lit * NoL) + m.ks * (lit * lobe);
}

vec3 ambient_reflectance(Phong m) {
    return m.ka;
}
