"""GLSL: fragment shaders that are written for just the picture of the works. Two peers share them."""

# Kind of lights -> fragment shader. The constants are those of glshade.bench.stage.
FRAGMENT = {
    "directional": """\
#version 330
in vec3 p, n;
out vec4 colour;
uniform vec3 eye, to_light;
const vec3 kd = vec3(0.8, 0.3, 0.2);

void main() {
    vec3 N = normalize(n), v = normalize(eye - p);
    float d = max(dot(N, to_light), 0.0);
    float s = max(dot(reflect(-to_light, N), v), 0.0);
    colour = vec4(kd * (0.1 + d) + (d > 0.0 ? 0.5 * pow(s, 32.0) : 0.0), 1.0);
}
""",
    "points": """\
#version 330
in vec3 p, n;
out vec4 colour;
uniform vec3 eye, positions[8], colours[8];
const vec3 kd = vec3(0.8, 0.3, 0.2);

void main() {
    vec3 N = normalize(n), v = normalize(eye - p);
    vec3 sum = 0.1 * kd;
    for (int i = 0; i < 8; i++) {
        vec3 l = normalize(positions[i] - p);
        float d = max(dot(N, l), 0.0);
        float s = max(dot(reflect(-l, N), v), 0.0);
        sum += colours[i] * (kd * d + (d > 0.0 ? 0.5 * pow(s, 32.0) : 0.0));
    }
    colour = vec4(sum, 1.0);
}
""",
}
