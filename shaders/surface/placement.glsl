// Transforms vertices from object space to clip space through world space relative to the eye. Positions near the viewer then
// keep their digits in float32, however far the viewer is from the origin.
// gl_Position is invariant, because another program adds further pages of lights where the depth is equal.
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
