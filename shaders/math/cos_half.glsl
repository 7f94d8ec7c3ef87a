// The cosine, at most 1, of half the angle between the unit vectors a and b. It is computed from the length `sum` of a + b or
// from a - b, whichever is more precise, because Schlick's (1 - cos)^5 multiplies the relative error of 1 - cos by 5.
float cos_half(vec3 a, vec3 b, float sum) {
    float c = 0.5 * sum;
    vec3 q = a - b;
    return c > 0.7 ? 1.0 - 0.25 * dot(q, q) / (1.0 + c) : c;
}
