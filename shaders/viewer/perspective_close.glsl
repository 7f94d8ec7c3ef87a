#include "lib/unit_scaled.glsl"

// As in perspective.glsl, where the near plane is so close that the square of the way is lost beside FLT_MIN.
vec3 viewer(vec3 p) {
    return unit_scaled(-p);
}
