#version 330 core
// Evaluates a model at one pair of directions per vertex. Transform feedback captures the values.
#include <model>

in vec3 a_l;
in vec3 a_v;
out vec3 v_value;

void main() {
    v_value = value(a_l, a_v);
    gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
}
