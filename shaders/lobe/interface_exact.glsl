#include "math/constants.glsl"
#include "optics/f_dielectric.glsl"

// The smooth interface of a dielectric by Fresnel's formulas. eta >= 1 is the refractive index inside divided by that outside.
// interface_reflects returns the share of light that a facet reflects.
float interface_reflects(float LoH, float eta) {
    return f_dielectric(LoH, eta);
}

// The share of light that passes, 1 - F without the subtraction, where c is the cosine outside. Each polarisation contributes
// 4 x y/(x + y)^2 with x = c or x = eta^2 c, and y = eta cos(inside) = sqrt(eta^2 - 1 + c^2).
float interface_passes(float c, float eta) {
    c = max(c, 0.0);
    // y is never below c, but the squares of numbers near 1e-20 are flushed to 0.
    float y = max(sqrt((eta - 1.0) * (eta + 1.0) + c * c), max(c, FLT_MIN));
    float x = eta * eta * c;
    float s = 1.0 / (c + y);
    float p = 1.0 / (x + y);
    return 2.0 * ((c * s) * (y * s) + (x * p) * (y * p));
}

// The share of diffuse light from outside that is reflected: the integral of 2 c F(c) over [0, 1] in closed form (Walsh 1926,
// Duntley 1942). It is written in z = (eta - 1)/(eta + 1), where its poles at eta = 1 cancel.
float interface_diffuse(float eta) {
    float z = (eta - 1.0) / (eta + 1.0);
    float q = z * z;
    // `rest` is (atanh(z)/z - 1)/z^2 = 1/3 + z^2/5 + z^4/7 + ..., a Chebyshev fit with an error of 2e-8 for z <= 1/2.
    float rest = 0.333333313 + q * (0.200004965 + q * (0.142632425 + q * (0.114782251 + q * (0.0645500347 + q * 0.158137545))));
    float b = -2.0 + z * (5.0 - z * (2.0 + z * (4.0 + q)) + rest * (1.0 + q * (5.0 - q * (5.0 + q))));
    float q1 = 1.0 / (1.0 + q);
    float q3 = q1 * q1 * q1;
    float z1 = 1.0 + z;
    float logarithm = 2.0 * q * z1 * z1 * q3 * log(max(z, FLT_MIN));
    return 0.5 + z * (2.0 + z) * (1.0 / 6.0) + 0.25 * z1 * z1 * z1 * (1.0 - z) * q3 * b + logarithm;
}
