#version 330 core
// Reads a texture with coordinates that grow linearly over each square of 2 x 2 pixels, in its own way. The coordinates are
// (0, 0) in the square's lower left pixel.
uniform sampler2D u_samples;  // the changes du/dx, dv/dx, du/dy, dv/dy from pixel to pixel in each square
uniform sampler2D u_texture;  // the texture, on unit 1
out vec4 o_value;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 change = texelFetch(u_samples, pixel / 2, 0);
    vec2 place = vec2(pixel % 2);
    o_value = texture(u_texture, place.x * change.xy + place.y * change.zw);
}
