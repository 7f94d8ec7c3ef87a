#include "lib/unit.glsl"

// Positions are relative to the eye, so the way to the viewer is the way back.
vec3 viewer(vec3 p) {
    return unit(-p);
}
