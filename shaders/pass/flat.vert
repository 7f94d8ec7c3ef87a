#version 330 core
// Flat shading (lecture slide 56): the model is evaluated once per triangle, at its centroid with its face normal. All three
// corners carry the same centroid and normal.
#include "surface/placement.glsl"
#include <surface>

flat out vec3 v_radiance;

void main() {
    interpolate();
    v_radiance = radiance(1.0);
    gl_Position = clip_position();
}
