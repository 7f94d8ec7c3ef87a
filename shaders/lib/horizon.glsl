// The direction to the viewer, lifted onto the horizon of n where an interpolated normal has turned away from it.
// The pixel is seen, so its surface does face the viewer; only n, an average of neighbours, says otherwise. Every model is
// 0 for a viewer below the horizon, which would draw a black rim round coarse smooth meshes. 1e-3 is far below what a
// picture shows and far above the rounding of n.v.
// The length of the sum is worked out from its parts along v and across, which need not wait for it.
vec3 above_horizon(vec3 v, vec3 n) {
    float NoV = dot(n, v);
    vec3 across = cross(n, v);
    float lift = max(1e-3 - NoV, 0.0);
    float along = 1.0 + lift * NoV;
    return (v + lift * n) * inversesqrt(along * along + lift * lift * dot(across, across));
}
