#version 330 core
// Gouraud shading of a surface that is seen from both sides: a pixel gets the interpolated colour of the side that it shows.
#include <surface>
#include <output>

centroid in vec3 v_front;
centroid in vec3 v_back;
out vec4 o_colour;

void main() {
    o_colour = encode((gl_FrontFacing ? v_front : v_back) / centroid_scale(), alpha());
}
