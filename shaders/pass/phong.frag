#version 330 core
// Phong shading (lecture slide 61): the model is evaluated at every pixel.
#include <surface>
#include <output>

out vec4 o_colour;

void main() {
    o_colour = encode(radiance(1.0), alpha());
}
