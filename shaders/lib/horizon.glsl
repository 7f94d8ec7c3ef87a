#include "lib/unit.glsl"

// The direction to the viewer, lifted onto the horizon of n where an interpolated normal has turned away from it.
// The pixel is seen, so its surface does face the viewer; only n, an average of neighbours, says otherwise. Every model is
// 0 for a viewer below the horizon, which would draw a black rim round coarse smooth meshes. 1e-3 is far below what a
// picture shows and far above the rounding of n.v.
vec3 above_horizon(vec3 v, vec3 n) {
    return unit(v + n * max(1e-3 - dot(n, v), 0.0));
}
