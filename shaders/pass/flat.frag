#version 330 core
// Flat shading: every pixel of a triangle gets the colour that the vertex stage has computed.
#include <surface>
#include <output>

flat in vec3 v_radiance;
out vec4 o_colour;

void main() {
    o_colour = encode(v_radiance, alpha());
}
