#include "math/constants.glsl"
#include "surface/frame.glsl"
#include "lobe/grazing.glsl"

// The model of Minnaert 1941: kd (k + 1)/(2 pi) ((n.l) (n.v))^(k - 1) n.l.
struct Minnaert {
    vec3 kd;
    float k;
};

vec3 brdf_cos(Minnaert m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    float NoV = dot(f.n, v);
    // For k < 1 the power has a pole where a cosine is 0. There it is computed as x^k / x, because the exponent k amplifies the
    // rounding of the logarithms less than k - 1 does. The logarithms are added, because the product of two small cosines would
    // be flushed to 0.
    bool pole = m.k < 1.0;
    float a = max(NoL, pole ? GRAZING : FLT_MIN);
    float b = max(NoV, pole ? GRAZING : FLT_MIN);
    float power = exp2((pole ? m.k : m.k - 1.0) * (log2(a) + log2(b))) * (pole ? NoL / a / b : NoL);
    float norm = 0.5 * INV_PI * (m.k + 1.0);
    return m.kd * (NoL > 0.0 && NoV > 0.0 ? norm * power : 0.0);
}

vec3 ambient_reflectance(Minnaert m) {
    return m.kd;
}
