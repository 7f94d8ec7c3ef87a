#include "surface/frame.glsl"
#include "math/unit.glsl"

// The shading frame of an interpolated normal and tangent. The tangent is made perpendicular to the normal (Gram-Schmidt), and
// tangent.w is the sign of the bitangent. A side of -1 reverses the normal and keeps tangent and bitangent.
Frame tangent_frame(vec3 normal, vec4 tangent, float side) {
    vec3 n = unit(normal);
    vec3 t = unit(tangent.xyz - n * dot(n, tangent.xyz));
    return Frame(side * n, t, cross(n, t) * tangent.w);
}
