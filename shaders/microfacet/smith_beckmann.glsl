#include "lib/constants.glsl"

// ierfc(x) = exp(-x^2)/sqrt(pi) - x erfc(x), the integral of erfc from x on, for x >= 0: a least-maximum fit of the form
// (1 + y)^-16 / sqrt(pi), y a polynomial. It is off by 2e-8 of 2 x + ierfc(x), and with its roundings by 1.7e-7; that is the
// share of the shadowing it errs by.
float ierfc(float x) {
    float y = 9.39938925e-3 + x * (9.85803956e-4 + x * (1.21520052e-4 + x * 6.58739504e-5));
    y = x * (0.110778281 + x * (0.0418121851 + x * y));
    // (1 + y)^2 = 1 + y (2 + y): of a small y no digit is lost to the 1.
    y *= 2.0 + y;
    y *= 2.0 + y;
    y *= 2.0 + y;
    y *= 2.0 + y;
    return 0.564189584 / (1.0 + y);
}

// G2/(4 n.v) with Smith's shadowing for Beckmann's distribution, height-correlated: 1/(1 + Lambda(l) + Lambda(v))
// (Smith 1967; Heitz 2014, eq. 99). Lambda = ierfc(x)/(2 x), x = cos/(alpha sin): multiplied by the cosines it is
// finite in the horizon.
float visible(float NoL, float NoV, float H2, float NoH, float alpha) {
    vec2 c = vec2(NoL, NoV);
    vec2 spread = alpha * sqrt(max((1.0 - c) * (1.0 + c), 0.0));
    // Beyond 8, ierfc is 0 to float32 beside 1.
    vec2 x = min(c / max(spread, FLT_MIN), 8.0);
    float Ll = spread.x * ierfc(x.x);
    float Lv = spread.y * ierfc(x.y);
    return NoL / max(4.0 * NoL * NoV + 2.0 * (NoL * Lv + NoV * Ll), FLT_MIN);
}
