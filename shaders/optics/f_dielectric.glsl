#include "math/constants.glsl"

// The Fresnel reflectance of a dielectric for unpolarised light, as in Cook and Torrance 1982: F = A^2 (1 + B^2) / 2 with
// A = (g - c)/(g + c), B = (c (g + c) - 1)/(c (g - c) + 1), g^2 = eta^2 - 1 + c^2 and c = l.h. eta >= 1 is the refractive index
// inside divided by that outside. A is computed as (eta^2 - 1)/(g + c)^2, which keeps its digits near eta = 1.
float f_dielectric(float LoH, float eta) {
    float e = (eta - 1.0) * (eta + 1.0);
    float g = sqrt(e + LoH * LoH);
    float sum = g + LoH;
    float A = e / max(sum * sum, FLT_MIN);
    float B = (LoH * sum - 1.0) / (LoH * (g - LoH) + 1.0);
    return 0.5 * A * A * (1.0 + B * B);
}
