#include "lib/constants.glsl"

// The part of paint that the flakes leave to the pigment: ideal diffuse, times n.l.
vec3 pigment(Paint m, float NoL) {
    return m.kd * ((1.0 - m.flakes) * INV_PI * NoL);
}
