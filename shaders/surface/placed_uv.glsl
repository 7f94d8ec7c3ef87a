// The texture coordinates of a picture that is scaled, turned and moved on a mesh. `across` and `up` are the rows of the matrix
// from the mesh's texture coordinates (u, v, 1).
vec2 placed_uv(vec2 uv, vec3 across, vec3 up) {
    return vec2(dot(across, vec3(uv, 1.0)), dot(up, vec3(uv, 1.0)));
}
