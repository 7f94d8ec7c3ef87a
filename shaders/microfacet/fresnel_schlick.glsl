#include "optics/f0_conductor.glsl"
#include "optics/f_schlick.glsl"

// Schlick's Fresnel term, for models whose materials choose between it and the exact one. Its error for metals is up to 0.255.
vec3 fresnel(vec3 eta, vec3 k, float LoH) {
    return f_schlick(f0_conductor(eta, k), LoH);
}
