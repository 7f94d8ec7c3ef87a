#include "math/constants.glsl"

// Beckmann's distribution of microfacet normals, D [1/sr] (Beckmann and Spizzichino 1963; Walter et al. 2007, eq. 25), times
// `weight`: exp(-tan^2/alpha^2) / (pi alpha^2 cos^4), where the angle is that between n and h. Its cosine NoH is an argument,
// because the caller can compute it more precisely than dot(n, h).
float d_beckmann(vec3 n, vec3 h, float NoH, float alpha, float weight) {
    // sin^2 comes from h - n, which is exact for nearly equal vectors.
    vec3 d = h - n;
    float s = 0.5 * dot(d, d);
    float width = alpha * NoH;
    float x = s * (2.0 - s) / max(width * width, FLT_MIN);
    // Where cos^2 is below 1e-8, the exponential is 0 for every alpha up to 1.
    float cos2 = max(NoH * NoH, 1e-8);
    float scale = INV_PI * weight / (alpha * alpha * cos2 * cos2);
    // For large x the square root of the exponential is applied twice, because the exponential alone would be flushed to 0
    // where its product with `scale` is a normal number.
    bool flushed = x > 64.0;
    float e = exp(flushed ? -0.5 * x : -x);
    return e * scale * (flushed ? e : 1.0);
}
