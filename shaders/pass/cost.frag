#version 330 core
// Evaluates a model many times per pixel, to time it in the fragment stage.
#include "driver/evaluations.glsl"

out vec4 o_value;

void main() {
    o_value = vec4(evaluations(gl_FragCoord.xy), 1.0);
}
