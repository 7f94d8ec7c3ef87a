#version 330 core
// Red is the interpolated x minus the x of the pixel's centre [pixels]; alpha is 1 where a triangle covers the pixel.
in float v_x;
out vec4 o_value;

void main() {
    o_value = vec4(v_x - gl_FragCoord.x, 0.0, 0.0, 1.0);
}
