#version 330 core
// Copies a texture texel by texel. If a value differs afterwards, it was changed when it was stored.
uniform sampler2D u_samples;
out vec4 o_value;

void main() {
    o_value = texelFetch(u_samples, ivec2(gl_FragCoord.xy), 0);
}
