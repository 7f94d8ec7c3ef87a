#include "surface/placement.glsl"
#include "math/unit_scaled.glsl"

// Transforms tangents. u_handedness is -1 if the transform mirrors, else 1.
uniform float u_handedness;

vec4 world_tangent(vec4 t_object) {
    return vec4(unit_scaled(mat3(u_world_from_object) * t_object.xyz), u_handedness * t_object.w);
}
