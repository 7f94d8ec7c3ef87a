#version 330 core
// Evaluates a model many times per vertex, to time it in the vertex stage.
#include "driver/evaluations.glsl"

out vec3 v_value;

void main() {
    v_value = evaluations(vec2(gl_VertexID & 127, gl_VertexID >> 7));
    gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
}
