#include "math/unit.glsl"

// The direction to the viewer of a perspective view. Positions are relative to the eye, so this is the direction of -p.
vec3 viewer(vec3 p) {
    return unit(-p);
}
