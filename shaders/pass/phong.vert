#version 330 core
// Phong shading (lecture slide 61): this stage transforms the vertices; the fragment stage evaluates the model.
#include "surface/placement.glsl"
#include <surface>

void main() {
    interpolate();
    gl_Position = clip_position();
}
