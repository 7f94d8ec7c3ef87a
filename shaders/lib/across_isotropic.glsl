#include "lib/frame.glsl"

// The square of what of H lies across the normal, all of it in x: for models that do not look at the tangents.
vec2 across(Frame f, vec3 H) {
    vec3 level = H - dot(f.n, H) * f.n;
    return vec2(dot(level, level), 0.0);
}
