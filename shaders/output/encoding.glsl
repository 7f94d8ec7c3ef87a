// The sRGB encoding of IEC 61966-2-1, from linear [0, 1] to encoded [0, 1]. The power 1/2.4 is a rational function of the
// square root, a minimax fit for [0.0031308, 1]. Its error is at most 0.005 of an 8-bit code, at less than half the cost of
// pow.
vec3 linear_to_srgb(vec3 c) {
    c = clamp(c, 0.0, 1.0);
    vec3 s = sqrt(c);
    vec3 above = -0.04714325 + s * (1.3450693 + s * (10.58884655 + s * 4.35064285));
    vec3 below = 1.0 + s * (9.18477919 + s * 6.05234451);
    return mix(12.92 * c, above / below, greaterThan(c, vec3(0.0031308)));
}
