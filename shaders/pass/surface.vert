#version 330 core
// What is seen in every pixel: how far it is and which object it belongs to. No light takes part.
#include "lib/clip.glsl"
#include <surface>

uniform vec3 u_forward;
out float v_depth;

void main() {
    interpolate();
    // Along the view axis, and linear in space: interpolation is exact.
    v_depth = dot(u_forward, world(a_position));
    gl_Position = clip_position();
}
