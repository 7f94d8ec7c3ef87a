#include "surface/frame.glsl"

// The squared components of H along the tangent and along the bitangent, for models that use the tangents.
vec2 across(Frame f, vec3 H) {
    vec2 xy = vec2(dot(f.t, H), dot(f.b, H));
    return xy * xy;
}
