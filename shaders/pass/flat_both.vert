#version 330 core
// Flat shading of a surface that is seen from both sides. The vertex stage can decide which side is seen, because a plane shows
// the same side to the viewer everywhere.
#include "surface/placement.glsl"
#include <surface>

flat out vec3 v_radiance;

void main() {
    interpolate();
    v_radiance = radiance(faces_viewer() ? 1.0 : -1.0);
    gl_Position = clip_position();
}
