// The unit direction of a texel of a direction map, 2 rg - 1 normalised. Vectors shorter than 0.01 count as the tangent's own
// direction: 8 bits cannot represent 0, and the two nearest values, 127 and 128, give vectors of length 0.0055.
vec2 mapped_direction(vec2 rg) {
    vec2 d = 2.0 * rg - 1.0;
    float length2 = dot(d, d);
    return length2 > 1e-4 ? d * inversesqrt(length2) : vec2(1.0, 0.0);
}
