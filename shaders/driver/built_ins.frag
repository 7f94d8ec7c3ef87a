#version 330 core
// Evaluates one built-in function per draw, at one pair of arguments per pixel. The program is compiled once: u_function
// selects the function, in the order of FUNCTIONS in glshade/driver/arithmetic.py.
uniform sampler2D u_samples;  // the arguments a and b of each pixel, in red and green
uniform int u_function;
out vec4 o_value;

float value(float a, float b) {
    switch (u_function) {
    case 0:
        return a + b;
    case 1:
        return a - b;
    case 2:
        return a * b;
    case 3:
        return a / b;
    case 4:
        return sqrt(a);
    case 5:
        return inversesqrt(a);
    case 6:
        return exp2(a);
    case 7:
        return log2(a);
    case 8:
        return sin(a);
    case 9:
        return cos(a);
    case 10:
        return pow(a, b);
    case 11:
        return acos(a);
    case 12:
        return atan(a);
    }
    return a;
}

void main() {
    vec2 arguments = texelFetch(u_samples, ivec2(gl_FragCoord.xy), 0).xy;
    o_value = vec4(value(arguments.x, arguments.y), 0.0, 0.0, 1.0);
}
