#include "lib/constants.glsl"
#include "lib/cospow.glsl"
#include "lib/frame.glsl"

// Lafortune et al. 1997, C = (1, 1, 1); lecture slide 6: (kd/pi + ks (p + 2)/(2 pi) max(l.v, 0)^p) n.l.
struct RetroPhong {
    vec3 kd;
    vec3 ks;
    float exponent;
};

vec3 brdf_cos(RetroPhong m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    // The lobe's root, squared in the end: its tail would vanish below FLT_MIN before p makes it large again.
    float root = cospow(v, l, 0.5 * m.exponent);
    float lobe = (0.5 * m.exponent + 1.0) * root * root;
    float lit = NoL > 0.0 && dot(f.n, v) > 0.0 ? INV_PI * NoL : 0.0;
    return m.kd * lit + m.ks * (lit * lobe);
}

vec3 ambient_reflectance(RetroPhong m) {
    return m.kd;
}
