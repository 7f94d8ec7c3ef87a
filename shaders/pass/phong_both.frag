#version 330 core
#include <surface>
#include <output>

out vec4 o_colour;

void main() {
    o_colour = encode(radiance(gl_FrontFacing ? 1.0 : -1.0), alpha());
}
