#include "surface/axes.glsl"
#include "surface/frame.glsl"

// The terms along the tangent, the bitangent and the normal, for models that use the tangents.
Axes axes(Frame f, vec3 l, vec3 v) {
    vec3 a = vec3(dot(f.t, l), dot(f.b, l), dot(f.n, l));
    vec3 b = vec3(dot(f.t, v), dot(f.b, v), dot(f.n, v));
    return Axes(a * b, (a + b) * (a + b), (a - b) * (a - b), a * a + b * b);
}
