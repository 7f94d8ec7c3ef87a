#include "optics/f_conductor.glsl"
#include "surface/frame.glsl"

// The same reflectance by a form in which nothing cancels.
struct ConductorBySubtraction {
    vec3 eta;  // [1, 3] default 1.5: index of refraction
    vec3 k;    // [0, 5] default 0: index of absorption
};

vec3 brdf_cos(ConductorBySubtraction m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    return NoL > 0.0 ? f_conductor(m.eta, m.k, max(dot(f.n, v), 0.0)) * NoL : vec3(0.0);
}
