#include "surface/tangent_frame.glsl"

// The shading frame with the normal of a tangent-space normal map: 2 rgb - 1 has x along t, y along b and z along n. `scale`
// multiplies x and y.
Frame mapped_frame(vec3 normal, vec4 tangent, float side, vec3 rgb, float scale) {
    Frame f = tangent_frame(normal, tangent, side);
    vec3 m = 2.0 * rgb - 1.0;
    vec3 n = unit(f.t * (scale * m.x) + f.b * (scale * m.y) + f.n * m.z);
    vec3 t = unit(f.t - n * dot(n, f.t));
    return Frame(n, t, unit(f.b - n * dot(n, f.b) - t * dot(t, f.b)));
}
