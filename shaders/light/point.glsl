#include "math/unit.glsl"

// A point light, which shines equally in all directions (lecture slide 49). At the light's own position l is (0, 0, 0), so that
// no light is reflected.
struct PointLight {
    vec3 intensity;
    float r_min;
    vec3 position;
};

vec3 illuminate(PointLight light, vec3 p, out vec3 l) {
    l = unit(light.position - p);
    return light.intensity;
}
