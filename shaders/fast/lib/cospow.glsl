// max(a.b, 0)^p of two unit vectors by the textbook: off by about p * 1.3e-7, because the dot of near vectors has lost its
// digits. Takes the place of lib/cospow.glsl where a scene asks for fast arithmetic.
float cospow(vec3 a, vec3 b, float p) {
    float c = dot(a, b);
    return c > 0.0 ? pow(c, p) : 0.0;
}
