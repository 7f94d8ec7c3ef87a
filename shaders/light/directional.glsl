// A directional light: infinitely far away, so its direction and strength are the same everywhere (lecture slide 49).
struct DirectionalLight {
    vec3 intensity;
    vec3 l;
};

vec3 illuminate(DirectionalLight light, vec3 p, out vec3 l) {
    l = light.l;
    return light.intensity;
}
