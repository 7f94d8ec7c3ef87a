#version 330 core
#include <surface>
#include <output>

centroid in vec3 v_radiance;
out vec4 o_colour;

void main() {
    o_colour = encode(v_radiance, alpha());
}
