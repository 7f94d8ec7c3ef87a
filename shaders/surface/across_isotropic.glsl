#include "surface/frame.glsl"

// x is the squared length of H's projection onto the surface, and y is 0. This is for models that do not use the tangents.
vec2 across(Frame f, vec3 H) {
    vec3 level = H - dot(f.n, H) * f.n;
    return vec2(dot(level, level), 0.0);
}
