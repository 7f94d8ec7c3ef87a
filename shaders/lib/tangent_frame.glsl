#include "lib/frame.glsl"
#include "lib/unit.glsl"

// The frame of an interpolated normal and tangent. The tangent is made perpendicular (Gram-Schmidt), and w says on which
// side the bitangent lies. Turning the normal over leaves both where they are.
Frame tangent_frame(vec3 normal, vec4 tangent, float side) {
    vec3 n = unit(normal);
    vec3 t = unit(tangent.xyz - n * dot(n, tangent.xyz));
    return Frame(side * n, t, cross(n, t) * tangent.w);
}
