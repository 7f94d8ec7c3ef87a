#include "lib/unit.glsl"

// glTF's spot light (KHR_lights_punctual): the square of how far cos has come from the outer angle's to the inner one's.
// 1 - cos is compared, not cos, as in spot.glsl.
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
