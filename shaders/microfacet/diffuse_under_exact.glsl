#include "math/constants.glsl"
#include "optics/t_conductor.glsl"

// The diffuse term, times n.l, of the light that passes through the mean surface on the way in and on the way out: the coupling
// of Shirley et al. 1997, not rescaled, with the exact Fresnel term. NoL and NoV must not be negative.
vec3 diffuse(vec3 kd, vec3 eta, vec3 k, float NoL, float NoV) {
    return kd * t_conductor(eta, k, NoL) * t_conductor(eta, k, NoV) * (INV_PI * NoL);
}
