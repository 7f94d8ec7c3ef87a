// From the object's own space to the picture, through world space relative to the eye: float32 keeps its digits where the
// viewer is, however far from the origin that may be.
// Further lights are added where the depth is equal, by another program.
invariant gl_Position;

in vec3 a_position;
uniform mat4 u_world_from_object;
uniform mat4 u_clip_from_world;

vec3 world(vec3 p_object) {
    return (u_world_from_object * vec4(p_object, 1.0)).xyz;
}

vec4 clip_position() {
    return u_clip_from_world * vec4(world(a_position), 1.0);
}
