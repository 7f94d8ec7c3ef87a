// 1/r^2: the physical law; constant within r_min.
float falloff_inverse_square(vec3 to_light, float r_min) {
    return 1.0 / max(dot(to_light, to_light), r_min * r_min);
}
