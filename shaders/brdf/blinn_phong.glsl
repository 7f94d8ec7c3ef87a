#include "lib/constants.glsl"
#include "lib/cospow.glsl"
#include "lib/frame.glsl"

// Blinn 1977; lecture slide 20: (kd n.l + ks max(n.h, 0)^exponent) / pi, h = (l + v)/|l + v|.
struct BlinnPhong {
    vec3 kd;
    vec3 ks;
    float exponent;
    vec3 ka;
};

vec3 brdf_cos(BlinnPhong m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    float NoV = dot(f.n, v);
    vec3 H = l + v;
    // |H|^2 below 1e-12: l = -v to rounding, where no half vector is.
    float H2 = dot(H, H);
    float lobe = H2 > 1e-12 ? cospow(f.n, H * inversesqrt(max(H2, 1e-12)), m.exponent) : 0.0;
    float lit = NoL > 0.0 && NoV > 0.0 ? INV_PI : 0.0;
    return m.kd * (lit * NoL) + m.ks * (lit * lobe);
}

vec3 ambient_reflectance(BlinnPhong m) {
    return m.ka;
}
