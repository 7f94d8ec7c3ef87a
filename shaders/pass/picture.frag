#version 330 core
// Encodes a picture in linear premultiplied light for 8 bits, with straight alpha.
#include <output>

uniform sampler2D u_linear;
out vec4 o_colour;

void main() {
    vec4 c = texelFetch(u_linear, ivec2(gl_FragCoord.xy), 0);
    o_colour = vec4(encode(c.a > 0.0 ? c.rgb / c.a : vec3(0.0), 1.0).rgb, c.a);
}
