#version 330 core
// Gouraud shading: a pixel gets the interpolated colour of the vertices.
#include <surface>
#include <output>

centroid in vec3 v_radiance;
out vec4 o_colour;

void main() {
    o_colour = encode(v_radiance / centroid_scale(), alpha());
}
