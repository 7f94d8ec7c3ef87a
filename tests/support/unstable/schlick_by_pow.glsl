#include "surface/frame.glsl"

// Fresnel's reflectance by Schlick 1994, eq. 15, with pow(). Where a rounded cosine exceeds 1, pow() of a negative number is
// not defined.
struct SchlickByPow {
    vec3 f0;  // [0, 1] default 0.04: reflectance at normal incidence
};

vec3 brdf_cos(SchlickByPow m, Frame f, vec3 l, vec3 v) {
    vec3 h = normalize(l + v);  // loses digits
    vec3 fresnel = m.f0 + (1.0 - m.f0) * pow(1.0 - dot(v, h), 5.0);  // loses digits
    float NoL = dot(f.n, l);
    return NoL > 0.0 ? fresnel * NoL : vec3(0.0);
}
