// 1/r: the compromise of lecture slide 51; constant within r_min.
float falloff_inverse(vec3 to_light, float r_min) {
    return 1.0 / max(length(to_light), r_min);
}
