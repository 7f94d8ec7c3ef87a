// A light at infinity: the same direction and strength everywhere (lecture slide 49).
struct DirectionalLight {
    vec3 intensity;
    vec3 l;
};

vec3 illuminate(DirectionalLight light, vec3 p, out vec3 l) {
    l = light.l;
    return light.intensity;
}
