#version 330 core
// Gouraud shading of a surface seen from both sides: a vertex does not know which, so it is shaded once for each.
#include "lib/clip.glsl"
#include <surface>

centroid out vec3 v_front;
centroid out vec3 v_back;

void main() {
    interpolate();
    v_front = radiance(1.0);
    v_back = radiance(-1.0);
    gl_Position = clip_position();
}
