#version 330 core
#include <surface>
#include <output>

centroid in vec3 v_front;
centroid in vec3 v_back;
out vec4 o_colour;

void main() {
    o_colour = encode(gl_FrontFacing ? v_front : v_back, alpha());
}
