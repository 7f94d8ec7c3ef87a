#version 330 core
// Flat shading of a surface seen from both sides: a plane faces the viewer everywhere or nowhere.
#include "lib/clip.glsl"
#include <surface>

flat out vec3 v_radiance;

void main() {
    interpolate();
    v_radiance = radiance(faces_viewer() ? 1.0 : -1.0);
    gl_Position = clip_position();
}
