#include "math/constants.glsl"
#include "surface/frame.glsl"

// The qualitative model of Oren and Nayar 1994, eq. 31: kd/pi (A + B max(0, cos(dphi)) sin(alpha) tan(beta)) n.l.
struct OrenNayarQualitative {
    vec3 kd;
    float sigma;
};

vec3 brdf_cos(OrenNayarQualitative m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    float NoV = dot(f.n, v);
    // `product` is cos(dphi) sin(alpha) sin(beta) = l.v - n.l n.v, computed from the projections of l and v onto the surface.
    // It needs no azimuth, which is undefined for l = n and v = n.
    float product = dot(l - NoL * f.n, v - NoV * f.n);
    float s2 = m.sigma * m.sigma;
    float a = 1.0 - 0.5 * s2 / (s2 + 0.33);
    float b = 0.45 * s2 / (s2 + 0.09);
    // cos(beta) is the larger cosine, so NoL over it is at most 1.
    float value = a * NoL + b * max(product, 0.0) * (NoL / max(max(NoL, NoV), FLT_MIN));
    return m.kd * (NoL > 0.0 && NoV > 0.0 ? INV_PI * value : 0.0);
}

vec3 ambient_reflectance(OrenNayarQualitative m) {
    return m.kd;
}
