// The angle, in units of 90 degrees, whose sine is s >= 0 and whose cosine is c >= 0: 4/pi atan(s / (1 + c)), which
// is precise for small angles too. llvmpipe's acos errs by 4e-4 and its atan by 2e-5. Here atan(t)/t is a Chebyshev fit in t^2
// <= 1 with an error of 1.6e-8; with its roundings, the relative error of the angle is 2e-7.
float right_angles(float s, float c) {
    float t = s / (1.0 + c);
    float x = t * t;
    float series = 0.05422423 + x * (-0.02037824 + x * 0.00360844284);
    series = -0.18083274 + x * (0.135431364 + x * (-0.09543498 + x * series));
    // The form t + t (4/pi - 1 + ...) rounds only the final sum; the product of t and 4/pi would be rounded as well.
    return t + t * (0.27323954 + x * (-0.42440978 + x * (0.25455222 + x * series)));
}
