#include "math/constants.glsl"

// Returns x normalised. (0, 0, 0) stays (0, 0, 0), so that a surface without a normal is black and never NaN. The length of x
// must be in [1e-15, 1e19], so that its square does not overflow and FLT_MIN is negligible beside it.
vec3 unit(vec3 x) {
    return x * inversesqrt(dot(x, x) + FLT_MIN);
}
