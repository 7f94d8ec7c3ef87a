#include "lib/f0_conductor.glsl"
#include "lib/fresnel.glsl"

// Schlick's Fresnel, where the material leaves the choice open. Up to 0.23 off for metals.
vec3 fresnel(vec3 eta, vec3 k, float LoH) {
    return f_schlick(f0_conductor(eta, k), LoH);
}
