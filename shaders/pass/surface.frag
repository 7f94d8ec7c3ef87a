#version 330 core
#include <surface>

uniform float u_number;
in float v_depth;
out vec4 o_surface;

void main() {
    // A cut-out discards.
    o_surface = vec4(v_depth, u_number, 0.0, alpha());
}
