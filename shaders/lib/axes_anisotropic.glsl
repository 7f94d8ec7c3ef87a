#include "lib/axes.glsl"
#include "lib/frame.glsl"

Axes axes(Frame f, vec3 l, vec3 v) {
    vec3 a = vec3(dot(f.t, l), dot(f.b, l), dot(f.n, l));
    vec3 b = vec3(dot(f.t, v), dot(f.b, v), dot(f.n, v));
    return Axes(a * b, (a + b) * (a + b), (a - b) * (a - b), a * a + b * b);
}
