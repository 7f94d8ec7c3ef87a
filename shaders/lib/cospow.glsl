// max(a.b, 0)^p of two unit vectors, right for every p in [0, 1e8].
// pow(dot(a, b), p) errs by p * 1e-7, because the dot of near vectors has lost its digits. Here 1 - a.b = |a - b|^2 / 2
// keeps them, and log2 is taken as e + log2(m) with m in [3/4, 3/2): for the vectors that matter (e = 0) m - 1 is that
// difference itself, and log2(m) = 2 atanh((m - 1) / (m + 1)) / ln 2 by a polynomial, exact to 3e-9.
float cospow(vec3 a, vec3 b, float p) {
    vec3 q = a - b;
    float s = 0.5 * dot(q, q);
    float c = 1.0 - s;
    int bits = floatBitsToInt(c);
    int e = (bits - 0x3f400000) >> 23;
    float m = intBitsToFloat(bits - (e << 23));
    float z = (e == 0 ? -s : m - 1.0) / (1.0 + m);
    float z2 = z * z;
    // 2 atanh(z) / (z ln 2) as a polynomial in z^2, Chebyshev fit over |z| <= 1/5. In halves, and p where it waits for nothing:
    // the terms are worked out side by side.
    float series = (2.88539007 + z2 * 0.9618022) + (z2 * z2) * (0.57639556 + z2 * 0.43907771);
    // cos^0 is 1 on the whole upper hemisphere.
    return c > 0.0 ? exp2(p * float(e) + (p * z) * series) : 0.0;
}
