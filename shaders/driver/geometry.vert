#version 330 core
// Draws triangles whose corners are given in pixels, from the lower left. x is interpolated, to be compared with the pixel's x.
in vec2 a_corner;
uniform vec2 u_size;
out float v_x;

void main() {
    v_x = a_corner.x;
    gl_Position = vec4(2.0 * a_corner / u_size - 1.0, 0.0, 1.0);
}
