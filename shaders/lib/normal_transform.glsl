#include "lib/unit_scaled.glsl"

// The cofactor matrix of world_from_object, scaled to entries of about 1: right for flat, mirrored and tiny transforms,
// where an inverse would fail.
uniform mat3 u_normal_from_object;

vec3 world_normal(vec3 n_object) {
    return unit_scaled(u_normal_from_object * n_object);
}
