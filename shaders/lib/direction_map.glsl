// The unit direction that red and green hold, 2 rg - 1. What is shorter than 0.01 has none, and is along the tangent:
// 8 bits hold no 0, and their greys on either side of it, 127 and 128, are 0.0055 long.
vec2 mapped_direction(vec2 rg) {
    vec2 d = 2.0 * rg - 1.0;
    float length2 = dot(d, d);
    return length2 > 1e-4 ? d * inversesqrt(length2) : vec2(1.0, 0.0);
}
