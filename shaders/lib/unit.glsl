#include "lib/constants.glsl"

// x made unit; (0, 0, 0) stays (0, 0, 0), so that a surface without a normal is black and never NaN.
// For lengths within [1e-15, 1e19], where the square does not overflow and FLT_MIN is nothing beside it.
vec3 unit(vec3 x) {
    return x * inversesqrt(dot(x, x) + FLT_MIN);
}
