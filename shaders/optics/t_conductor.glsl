#include "optics/conductor.glsl"

// The share of light that passes, 1 - f_conductor, computed without the subtraction and never negative, from
// 1 - Rs = 4 a c / ((a + c)^2 + b^2) and 1 - Rp/Rs = 4 a c sin^2 / ((a c + sin^2)^2 + (b c)^2).
vec3 t_conductor(vec3 eta, vec3 k, float LoH) {
    float c = LoH;
    float sin2 = (1.0 - c) * (1.0 + c);
    vec3 a;
    vec3 b;
    conductor(eta, k, c, sin2, a, b);
    vec3 b2 = b * b;
    vec3 sum = a + c;
    vec3 ac = a * c;
    vec3 more = ac + sin2;
    vec3 Ts = min(4.0 * ac / max(sum * sum + b2, FLT_MIN), 1.0);
    return Ts + 2.0 * (1.0 - Ts) * ac * sin2 / max(more * more + b2 * (c * c), FLT_MIN);
}
