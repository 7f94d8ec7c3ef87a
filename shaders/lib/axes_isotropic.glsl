#include "lib/axes.glsl"
#include "lib/frame.glsl"

// Both axes of the plane in x, none in y: for models that do not look at the tangents.
Axes axes(Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    float NoV = dot(f.n, v);
    vec3 a = l - NoL * f.n;
    vec3 b = v - NoV * f.n;
    vec3 plus = a + b;
    vec3 minus = a - b;
    return Axes(vec3(dot(a, b), 0.0, NoL * NoV), vec3(dot(plus, plus), 0.0, (NoL + NoV) * (NoL + NoV)),
                vec3(dot(minus, minus), 0.0, (NoL - NoV) * (NoL - NoV)),
                vec3(dot(a, a) + dot(b, b), 0.0, NoL * NoL + NoV * NoV));
}
