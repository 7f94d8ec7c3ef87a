#include "lib/constants.glsl"

// A colour over its luminance, as near as Burley 2012 takes it: hue and saturation. White for black.
vec3 tint(vec3 kd) {
    float luminance = dot(vec3(0.3, 0.6, 0.1), kd);
    return luminance > FLT_MIN ? kd / luminance : vec3(1.0);
}
