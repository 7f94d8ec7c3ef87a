#include "lib/frame.glsl"

// The squares of H along the tangent and along the bitangent.
vec2 across(Frame f, vec3 H) {
    vec2 xy = vec2(dot(f.t, H), dot(f.b, H));
    return xy * xy;
}
