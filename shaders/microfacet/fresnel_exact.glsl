#include "optics/f_conductor.glsl"

// The exact Fresnel term, for models whose materials choose between it and Schlick's.
vec3 fresnel(vec3 eta, vec3 k, float LoH) {
    return f_conductor(eta, k, LoH);
}
