#include "math/constants.glsl"

// The hue and saturation of a colour: the colour divided by its luminance, as Burley 2012 approximates it. Black gives white.
vec3 tint(vec3 kd) {
    float luminance = dot(vec3(0.3, 0.6, 0.1), kd);
    return luminance > FLT_MIN ? kd / luminance : vec3(1.0);
}
