#include "math/constants.glsl"
#include "optics/t0_conductor.glsl"
#include "optics/t_schlick.glsl"

// The diffuse term, times n.l, of the light that passes through the mean surface on the way in and on the way out: the coupling
// of Shirley et al. 1997, not rescaled, with Schlick's Fresnel term. NoL and NoV must not be negative.
vec3 diffuse(vec3 kd, vec3 f0, float NoL, float NoV) {
    return kd * t_schlick(1.0 - f0, NoL) * t_schlick(1.0 - f0, NoV) * (INV_PI * NoL);
}

vec3 diffuse(vec3 kd, vec3 eta, vec3 k, float NoL, float NoV) {
    vec3 t0 = t0_conductor(eta, k);
    return kd * t_schlick(t0, NoL) * t_schlick(t0, NoV) * (INV_PI * NoL);
}
