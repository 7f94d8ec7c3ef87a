// The direction to the viewer, moved above the horizon of an interpolated normal that points away from the viewer. A visible
// pixel does face the viewer; only its normal n, an average of neighbours, may not. Every model is 0 for a viewer below the
// horizon, which would draw a black rim around coarse smooth meshes. So v is mirrored at the plane n.v = 1e-3,
// which is far above the rounding of n.v. The length of v + t n, squared, is 1 + 2e-3 t. The length is restored by a series,
// because a square root would slow down all pixels for the few that need it.
vec3 above_horizon(vec3 v, vec3 n) {
    float t = max(2e-3 - 2.0 * dot(n, v), 0.0);
    float x = 1e-3 * t;
    return (v + t * n) * (1.0 - x + 1.5 * x * x);
}
