// Returns max(a.b, 0)^p for two unit vectors a and b by the textbook formula. This file replaces math/cospow.glsl where a scene
// asks for fast arithmetic. The formula's relative error is about p * 1.3e-7, because the dot product of nearly equal vectors
// loses digits.
float cospow(vec3 a, vec3 b, float p) {
    float c = dot(a, b);
    return c > 0.0 ? pow(c, p) : 0.0;
}
