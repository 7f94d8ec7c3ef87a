#version 330 core
// Gouraud shading of a surface that is seen from both sides. The vertex stage does not know which side a pixel shows, so it
// evaluates the model for both.
#include "surface/placement.glsl"
#include <surface>

centroid out vec3 v_front;
centroid out vec3 v_back;

void main() {
    interpolate();
    v_front = radiance(1.0) * vertex_scale();
    v_back = radiance(-1.0) * vertex_scale();
    gl_Position = clip_position();
}
