#include "math/constants.glsl"
#include "math/cospow.glsl"
#include "surface/frame.glsl"

// A retroreflective Phong lobe over a diffuse base (Lafortune et al. 1997 with C = (1, 1, 1); lecture slide 6):
// (kd/pi + ks (p + 2)/(2 pi) max(l.v, 0)^p) n.l with the exponent p.
struct RetroPhong {
    vec3 kd;
    vec3 ks;
    float exponent;
};

vec3 brdf_cos(RetroPhong m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    // The square root of the lobe is squared last: its tail would be flushed to 0 before the factor in p makes it large again.
    float root = cospow(v, l, 0.5 * m.exponent);
    float lobe = (0.5 * m.exponent + 1.0) * root * root;
    float lit = NoL > 0.0 && dot(f.n, v) > 0.0 ? INV_PI * NoL : 0.0;
    return m.kd * lit + m.ks * (lit * lobe);
}

vec3 ambient_reflectance(RetroPhong m) {
    return m.kd;
}
