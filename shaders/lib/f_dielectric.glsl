#include "lib/constants.glsl"

// Fresnel for unpolarised light on a dielectric, as in Cook and Torrance 1982: F = A^2 (1 + B^2) / 2, A = (g - c)/(g + c),
// B = (c (g + c) - 1)/(c (g - c) + 1), g^2 = eta^2 - 1 + c^2.
// eta >= 1: the index inside over the one outside. A is (eta^2 - 1)/(g + c)^2, which keeps its digits near eta = 1.
float f_dielectric(float LoH, float eta) {
    float e = (eta - 1.0) * (eta + 1.0);
    float g = sqrt(e + LoH * LoH);
    float sum = g + LoH;
    float A = e / max(sum * sum, FLT_MIN);
    float B = (LoH * sum - 1.0) / (LoH * (g - LoH) + 1.0);
    return 0.5 * A * A * (1.0 + B * B);
}
