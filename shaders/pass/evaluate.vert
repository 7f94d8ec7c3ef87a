#version 330 core
// A model at given directions, one vertex each, for transform feedback.
#include <model>

in vec3 a_l;
in vec3 a_v;
out vec3 v_value;

void main() {
    v_value = value(a_l, a_v);
    gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
}
