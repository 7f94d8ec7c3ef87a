// Returns max(a.b, 0)^p for two unit vectors a and b. It is precise for every p in [0, 1e8].
// pow(dot(a, b), p) has a relative error of p * 1e-7, because the dot product of nearly equal vectors loses digits. Here
// |a - b|^2 / 2, which is 1 - a.b, keeps them. log2 is computed as e + log2(m) with m in [3/4, 3/2). For nearly equal vectors e
// is 0 and m - 1 is -|a - b|^2 / 2. log2(m) = 2 atanh((m - 1) / (m + 1)) / ln 2 comes from a polynomial with an error of 3e-9.
float cospow(vec3 a, vec3 b, float p) {
    vec3 q = a - b;
    float s = 0.5 * dot(q, q);
    float c = 1.0 - s;
    int bits = floatBitsToInt(c);
    int e = (bits - 0x3f400000) >> 23;
    float m = intBitsToFloat(bits - (e << 23));
    float z = (e == 0 ? -s : m - 1.0) / (1.0 + m);
    float z2 = z * z;
    // 2 atanh(z) / (z ln 2) as a polynomial in z^2, a Chebyshev fit for |z| <= 1/5. Its two halves, and the products with p, do
    // not depend on each other, so that the processor can compute them in parallel.
    float series = (2.88539007 + z2 * 0.9618022) + (z2 * z2) * (0.57639556 + z2 * 0.43907771);
    // For p = 0 the result is 1 wherever a.b > 0.
    return c > 0.0 ? exp2(p * float(e) + (p * z) * series) : 0.0;
}
