#include "lib/unit.glsl"

// A light at one place, alike in all directions (lecture slide 49). At the light itself l is (0, 0, 0): no light.
struct PointLight {
    vec3 intensity;
    float r_min;
    vec3 position;
};

vec3 illuminate(PointLight light, vec3 p, out vec3 l) {
    l = unit(light.position - p);
    return light.intensity;
}
