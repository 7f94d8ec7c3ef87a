#include "lib/constants.glsl"
#include "lib/t0_conductor.glsl"
#include "lib/t_schlick.glsl"

// Diffuse light, times n.l: what the mean surface lets in, and out again (the coupling of Shirley et al. 1997, unscaled,
// with Schlick's). NoL, NoV >= 0.
vec3 diffuse(vec3 kd, vec3 f0, float NoL, float NoV) {
    return kd * t_schlick(1.0 - f0, NoL) * t_schlick(1.0 - f0, NoV) * (INV_PI * NoL);
}

vec3 diffuse(vec3 kd, vec3 eta, vec3 k, float NoL, float NoV) {
    vec3 t0 = t0_conductor(eta, k);
    return kd * t_schlick(t0, NoL) * t_schlick(t0, NoV) * (INV_PI * NoL);
}
