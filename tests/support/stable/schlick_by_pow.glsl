#include "math/cos_half.glsl"
#include "surface/frame.glsl"

// The same reflectance by products, of a cosine that is at most 1.
struct SchlickByPow {
    vec3 f0;  // [0, 1] default 0.04: reflectance at normal incidence
};

vec3 brdf_cos(SchlickByPow m, Frame f, vec3 l, vec3 v) {
    float x = 1.0 - cos_half(l, v, length(l + v));
    float x2 = x * x;
    vec3 fresnel = m.f0 + (1.0 - m.f0) * (x2 * x2 * x);
    float NoL = dot(f.n, l);
    return NoL > 0.0 ? fresnel * NoL : vec3(0.0);
}
