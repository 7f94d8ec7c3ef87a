// The physical falloff 1/r^2 with the distance r. Below r_min it is constant.
float falloff_inverse_square(vec3 to_light, float r_min) {
    return 1.0 / max(dot(to_light, to_light), r_min * r_min);
}
