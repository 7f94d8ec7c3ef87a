#version 330 core
// A model many times a pixel, for its cost.
#include "lib/evaluations.glsl"

out vec4 o_value;

void main() {
    o_value = vec4(evaluations(gl_FragCoord.xy), 1.0);
}
