// The direction to the viewer, brought above the surface again where an interpolated normal has turned away from it.
// The pixel is seen, so its surface does face the viewer; only n, an average of neighbours, says otherwise. Every model is
// 0 for a viewer below the horizon, which would draw a black rim round coarse smooth meshes. So v is mirrored at the plane
// 1e-3 above the horizon, far above the rounding of n.v. |v + t n|^2 is 1 + 2e-3 t; the length is made 1 again by a series,
// since every picture would wait for a square root that next to no pixel needs.
vec3 above_horizon(vec3 v, vec3 n) {
    float t = max(2e-3 - 2.0 * dot(n, v), 0.0);
    float x = 1e-3 * t;
    return (v + t * n) * (1.0 - x + 1.5 * x * x);
}
