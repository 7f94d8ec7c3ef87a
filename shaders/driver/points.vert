#version 330 core

// Squares, or points of their centres, each in a shade of its own.
uniform mat4 u_clip_from_world;
in vec3 a_position;
flat out float v_shade;

void main() {
    v_shade = a_position.z;
    gl_Position = u_clip_from_world * vec4(a_position, 1.0);
}
