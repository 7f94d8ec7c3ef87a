#include "math/unit_scaled.glsl"

// The direction to the viewer, as in perspective.glsl, for a near plane so close that |p|^2 may be as small as FLT_MIN.
vec3 viewer(vec3 p) {
    return unit_scaled(-p);
}
