#include "math/constants.glsl"

// The pigment of paint, on the share of the surface without flakes: ideal diffuse reflection, times n.l.
vec3 pigment(Paint m, float NoL) {
    return m.kd * ((1.0 - m.flakes) * INV_PI * NoL);
}
