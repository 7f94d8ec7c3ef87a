#include "math/unit_scaled.glsl"

// Transforms normals by the cofactor matrix of world_from_object, scaled to entries of about 1. This matrix is also right
// for flat, mirrored and tiny transforms, whose inverse fails.
uniform mat3 u_normal_from_object;

vec3 world_normal(vec3 n_object) {
    return unit_scaled(u_normal_from_object * n_object);
}
