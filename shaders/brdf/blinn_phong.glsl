#include "math/constants.glsl"
#include "math/cospow.glsl"
#include "surface/frame.glsl"

// The model of Blinn 1977 (lecture slide 20): (kd n.l + ks max(n.h, 0)^exponent) / pi with h = (l + v)/|l + v|.
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
    // If |H|^2 is below 1e-12, it is only a rounding error: l is -v, and there is no half vector.
    float H2 = dot(H, H);
    float lobe = H2 > 1e-12 ? cospow(f.n, H * inversesqrt(max(H2, 1e-12)), m.exponent) : 0.0;
    float lit = NoL > 0.0 && NoV > 0.0 ? INV_PI : 0.0;
    return m.kd * (lit * NoL) + m.ks * (lit * lobe);
}

vec3 ambient_reflectance(BlinnPhong m) {
    return m.ka;
}
