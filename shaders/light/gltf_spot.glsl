#include "math/unit.glsl"

// The spot light of glTF (KHR_lights_punctual). Its strength is x^2, where x is linear in cos: 0 at cos(outer) and 1 at
// cos(inner). As in spot.glsl, 1 - cos is used in place of cos.
struct GltfSpotLight {
    vec3 intensity;
    float r_min;
    vec3 position;
    float cone_outer;  // 1 - cos(outer)
    vec3 axis;         // from the surface to the light, along the cone's axis; unit
    float cone_scale;  // 1 / (cone_outer - cone_inner)
};

vec3 illuminate(GltfSpotLight light, vec3 p, out vec3 l) {
    l = unit(light.position - p);
    vec3 q = l - light.axis;
    float x = clamp((light.cone_outer - 0.5 * dot(q, q)) * light.cone_scale, 0.0, 1.0);
    return light.intensity * (x * x);
}
