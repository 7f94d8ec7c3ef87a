// Returns asin(x) for |x| <= sqrt(1/2) with a relative error of 2e-8, by a Chebyshev fit of asin(x) / x in x^2. llvmpipe's own
// asin errs by 4e-4.
float arcsine(float x) {
    float u = x * x;
    float upper = 0.0158279045 + u * (0.078228919 + u * (-0.094046276 + u * 0.1119609));
    return x * (0.999999987 + u * (0.166669932 + u * (0.074868471 + u * (0.0466362156 + u * upper))));
}
