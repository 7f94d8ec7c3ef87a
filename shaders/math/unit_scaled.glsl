#include "math/constants.glsl"

// Returns x normalised, for any length, from denormal numbers up to 1e38. (0, 0, 0) stays (0, 0, 0).
vec3 unit_scaled(vec3 x) {
    vec3 a = abs(x);
    float largest = max(max(a.x, a.y), a.z);
    x /= max(largest, FLT_MIN);
    return x * inversesqrt(max(dot(x, x), FLT_MIN));
}
