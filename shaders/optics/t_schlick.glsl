// The share of light that passes, 1 - f_schlick, computed without the subtraction and never negative, with t0 = 1 - f0 and
// 1 - x^5 = (1 - x)(1 + x + x^2 + x^3 + x^4).
vec3 t_schlick(vec3 t0, float LoH) {
    float x = 1.0 - LoH;
    return t0 * (LoH * (1.0 + x * (1.0 + x * (1.0 + x * (1.0 + x)))));
}
