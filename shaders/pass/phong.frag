#version 330 core
#include <surface>
#include <output>

out vec4 o_colour;

void main() {
    o_colour = encode(radiance(1.0), alpha());
}
