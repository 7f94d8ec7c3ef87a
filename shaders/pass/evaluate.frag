#version 330 core
// Evaluates a model at one pair of directions per pixel.
#include <model>

uniform sampler2D u_l;
uniform sampler2D u_v;
out vec4 o_value;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    o_value = vec4(value(texelFetch(u_l, pixel, 0).xyz, texelFetch(u_v, pixel, 0).xyz), 1.0);
}
