#include "lib/constants.glsl"

// Beckmann's distribution of slopes, D [1/sr] (Beckmann and Spizzichino 1963; Walter et al. 2007, eq. 25), times weight:
// exp(-tan^2/alpha^2) / (pi alpha^2 cos^4) of the angle between n and h. NoH: its cosine, which the caller knows better than
// h does.
float d_beckmann(vec3 n, vec3 h, float NoH, float alpha, float weight) {
    // sin^2 from h - n, of near vectors exact.
    vec3 d = h - n;
    float s = 0.5 * dot(d, d);
    float width = alpha * NoH;
    float x = s * (2.0 - s) / max(width * width, FLT_MIN);
    // Below 1e-8 the exponential is 0 for every alpha up to 1.
    float cos2 = max(NoH * NoH, 1e-8);
    float scale = INV_PI * weight / (alpha * alpha * cos2 * cos2);
    // Far out, the root of the exponential twice: the whole of it would be flushed to 0 where the product is not.
    bool flushed = x > 64.0;
    float e = exp(flushed ? -0.5 * x : -x);
    return e * scale * (flushed ? e : 1.0);
}
