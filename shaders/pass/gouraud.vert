#version 330 core
// Gouraud shading (lecture slide 60): the model is evaluated at every vertex, and its colours are interpolated.
#include "surface/placement.glsl"
#include <surface>

centroid out vec3 v_radiance;

void main() {
    interpolate();
    v_radiance = radiance(1.0) * vertex_scale();
    gl_Position = clip_position();
}
