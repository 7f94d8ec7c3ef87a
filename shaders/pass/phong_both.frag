#version 330 core
// Phong shading of a surface that is seen from both sides: the normal is reversed where the back is seen.
#include <surface>
#include <output>

out vec4 o_colour;

void main() {
    o_colour = encode(radiance(gl_FrontFacing ? 1.0 : -1.0), alpha());
}
