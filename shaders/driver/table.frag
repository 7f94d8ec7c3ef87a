#version 330 core
// Reads a texture of three dimensions at the places that another texture holds.
uniform sampler2D u_samples;  // the texture coordinates of each pixel
uniform sampler3D u_table;    // the texture, on unit 1
out vec4 o_value;

void main() {
    vec3 place = texelFetch(u_samples, ivec2(gl_FragCoord.xy), 0).xyz;
    o_value = vec4(textureLod(u_table, place, 0.0).rgb, 1.0);
}
