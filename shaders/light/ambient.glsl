// Ambient light: the same from all directions, so its strength is the same for every normal.
struct AmbientLight {
    vec3 intensity;
};

vec3 illuminate(AmbientLight light, vec3 n) {
    return light.intensity;
}
