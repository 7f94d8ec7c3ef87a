#include "math/constants.glsl"

// Smith's shadowing for Beckmann's distribution needs ierfc(x) = exp(-x^2)/sqrt(pi) - x erfc(x), the integral of erfc from x to
// infinity, for x >= 0. The function below is a minimax fit (1 + y)^-16 / sqrt(pi) with a polynomial y. Relative to
// 2 x + ierfc(x), its error is 2e-8, and 1.7e-7 with roundings. This is also the relative error of the shadowing.
float ierfc(float x) {
    float y = 9.39938925e-3 + x * (9.85803956e-4 + x * (1.21520052e-4 + x * 6.58739504e-5));
    y = x * (0.110778281 + x * (0.0418121851 + x * y));
    // Each line squares 1 + y: (1 + y)^2 = 1 + y (2 + y). Keeping y alone preserves its digits where it is small.
    y *= 2.0 + y;
    y *= 2.0 + y;
    y *= 2.0 + y;
    y *= 2.0 + y;
    return 0.564189584 / (1.0 + y);
}

// G2/(4 n.v) with Smith's height-correlated shadowing for Beckmann's distribution, G2 = 1/(1 + Lambda(l) + Lambda(v))
// (Smith 1967; Heitz 2014, eq. 99). Lambda = ierfc(x)/(2 x) with x = cos/(alpha sin). The code multiplies by the cosines, so
// that the result is finite at the horizon.
float visible(float NoL, float NoV, float H2, float NoH, float alpha) {
    vec2 c = vec2(NoL, NoV);
    vec2 spread = alpha * sqrt(max((1.0 - c) * (1.0 + c), 0.0));
    // For x > 8, ierfc(x) is negligible beside 1 in float32.
    vec2 x = min(c / max(spread, FLT_MIN), 8.0);
    float Ll = spread.x * ierfc(x.x);
    float Lv = spread.y * ierfc(x.y);
    return NoL / max(4.0 * NoL * NoV + 2.0 * (NoL * Lv + NoV * Ll), FLT_MIN);
}
