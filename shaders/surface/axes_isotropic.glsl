#include "surface/axes.glsl"
#include "surface/frame.glsl"

// x has the terms of the projections onto the surface, y has 0, and z has the terms along the normal. This is for models that
// do not use the tangents.
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
