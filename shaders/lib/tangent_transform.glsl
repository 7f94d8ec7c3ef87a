#include "lib/clip.glsl"
#include "lib/unit_scaled.glsl"

// -1 where the transform mirrors, else 1.
uniform float u_handedness;

vec4 world_tangent(vec4 t_object) {
    return vec4(unit_scaled(mat3(u_world_from_object) * t_object.xyz), u_handedness * t_object.w);
}
