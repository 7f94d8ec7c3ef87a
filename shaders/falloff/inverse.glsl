// The falloff 1/r with the distance r, the compromise of lecture slide 51. Below r_min it is constant.
float falloff_inverse(vec3 to_light, float r_min) {
    return 1.0 / max(length(to_light), r_min);
}
