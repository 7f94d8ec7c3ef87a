// Light from everywhere alike (lecture slide 23: a hack, and needed). It has no direction, so it takes no point.
struct AmbientLight {
    vec3 intensity;
};

vec3 illuminate(AmbientLight light) {
    return light.intensity;
}
