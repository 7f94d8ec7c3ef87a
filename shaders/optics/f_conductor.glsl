#include "optics/conductor.glsl"

// The Fresnel reflectance of a conductor of index eta + i k for unpolarised light, as in Cook and Torrance 1982 with a complex
// index; k = 0 gives a dielectric. With a and b from conductor.glsl and c = l.h, Rs = ((a - c)^2 + b^2)/((a + c)^2 + b^2),
// Rp = Rs ((a c - sin^2)^2 + (b c)^2)/((a c + sin^2)^2 + (b c)^2), and F is the mean of Rs and Rp.
vec3 f_conductor(vec3 eta, vec3 k, float LoH) {
    float c = LoH;
    float sin2 = (1.0 - c) * (1.0 + c);
    vec3 a;
    vec3 b;
    conductor(eta, k, c, sin2, a, b);
    vec3 b2 = b * b;
    vec3 sum = a + c;
    // a - c = (a^2 - c^2)/(a + c) keeps the digits of an index near 1. Where b is larger than a, the rounding of a - c is
    // negligible beside b.
    vec3 step = ((eta - 1.0) * (eta + 1.0) - k * k + b2) / max(sum, FLT_MIN);
    vec3 difference = mix(a - c, step, greaterThan(a, b));
    vec3 Rs = (difference * difference + b2) / max(sum * sum + b2, FLT_MIN);
    vec3 bc2 = b2 * (c * c);
    vec3 less = a * c - sin2;
    vec3 more = a * c + sin2;
    return 0.5 * Rs * (1.0 + (less * less + bc2) / max(more * more + bc2, FLT_MIN));
}
