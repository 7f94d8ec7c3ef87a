// The cosine of half the angle between the unit vectors a and b, from their sum, of length `sum`, or their difference,
// whichever has more digits; at most 1. Schlick's (1 - cos)^5 multiplies an error of 1 - cos by 5.
float cos_half(vec3 a, vec3 b, float sum) {
    float c = 0.5 * sum;
    vec3 q = a - b;
    return c > 0.7 ? 1.0 - 0.25 * dot(q, q) / (1.0 + c) : c;
}
