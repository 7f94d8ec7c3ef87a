#include "math/constants.glsl"
#include "optics/t_schlick.glsl"

// Returns f cos of the diffuse part: of light that the microfacet with normal h does not reflect (glTF 2.0, appendix B.3.5).
vec3 diffuse(vec3 kd, vec3 f0, float LoH, float NoL) {
    return kd * t_schlick(1.0 - f0, LoH) * (INV_PI * NoL);
}
