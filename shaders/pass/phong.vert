#version 330 core
// Phong shading (lecture slide 61): the model is evaluated at every pixel; this stage only places and hands on.
#include "lib/clip.glsl"
#include <surface>

void main() {
    interpolate();
    gl_Position = clip_position();
}
