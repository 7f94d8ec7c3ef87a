#include "math/unit.glsl"

// A spot light: a point light that shines into a cone (lecture slide 52), with full strength within the inner angle, 0
// beyond the outer angle, and smoothstep between them. 1 - cos is used in place of cos, because computed as |a - b|^2 / 2 it
// keeps its digits for cones as narrow as 1e-4 rad.
struct SpotLight {
    vec3 intensity;
    float r_min;
    vec3 position;
    float cone_outer;  // 1 - cos(outer)
    vec3 axis;         // from the surface to the light, along the cone's axis; unit
    float cone_scale;  // 1 / (cone_outer - cone_inner)
};

vec3 illuminate(SpotLight light, vec3 p, out vec3 l) {
    l = unit(light.position - p);
    vec3 q = l - light.axis;
    float x = clamp((light.cone_outer - 0.5 * dot(q, q)) * light.cone_scale, 0.0, 1.0);
    return light.intensity * (x * x * (3.0 - 2.0 * x));
}
