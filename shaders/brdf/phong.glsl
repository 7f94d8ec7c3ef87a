#include "math/constants.glsl"
#include "math/cospow.glsl"
#include "surface/frame.glsl"

// The model of Phong 1975 (lecture slides 17-24): (kd n.l + ks max(r.v, 0)^exponent) / pi, where r is l mirrored at n.
// On slides 18 and 24, light from behind the surface leaks through where r.v > 0; here it is 0 (erratum).
struct Phong {
    vec3 kd;
    vec3 ks;
    float exponent;
    vec3 ka;
};

vec3 brdf_cos(Phong m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    float NoV = dot(f.n, v);
    // r.v is computed as l.(v mirrored at n), because the mirrored v is the same for every light.
    float lobe = cospow(2.0 * NoV * f.n - v, l, m.exponent);
    float lit = NoL > 0.0 && NoV > 0.0 ? INV_PI : 0.0;
    return m.kd * (lit * NoL) + m.ks * (lit * lobe);
}

vec3 ambient_reflectance(Phong m) {
    return m.ka;
}
