// The angle, in right angles, of a sine and a cosine that are not negative: 4/pi atan(s / (1 + c)), right for small angles too.
// llvmpipe's acos errs by 4e-4 and its atan by 2e-5; here atan(t)/t is a polynomial in t^2 <= 1, a Chebyshev fit within
// 1.6e-8, and with its roundings the angle is within 2e-7 of itself.
float right_angles(float s, float c) {
    float t = s / (1.0 + c);
    float x = t * t;
    float series = 0.05422423 + x * (-0.02037824 + x * 0.00360844284);
    series = -0.18083274 + x * (0.135431364 + x * (-0.09543498 + x * series));
    // t + t (4/pi - 1 + ...): the last rounding is that of a sum, not of a product as well.
    return t + t * (0.27323954 + x * (-0.42440978 + x * (0.25455222 + x * series)));
}
