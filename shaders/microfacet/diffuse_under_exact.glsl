#include "lib/constants.glsl"
#include "lib/t_conductor.glsl"

// Diffuse light, times n.l: what the mean surface lets in, and out again (the coupling of Shirley et al. 1997, unscaled,
// with the exact Fresnel). NoL, NoV >= 0.
vec3 diffuse(vec3 kd, vec3 eta, vec3 k, float NoL, float NoV) {
    return kd * t_conductor(eta, k, NoL) * t_conductor(eta, k, NoV) * (INV_PI * NoL);
}
