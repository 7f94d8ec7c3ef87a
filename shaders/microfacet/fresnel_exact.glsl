#include "lib/f_conductor.glsl"

// The exact Fresnel, where the material leaves the choice open.
vec3 fresnel(vec3 eta, vec3 k, float LoH) {
    return f_conductor(eta, k, LoH);
}
