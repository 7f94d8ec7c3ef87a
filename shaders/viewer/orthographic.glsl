// The direction to a viewer at infinity, which is the same everywhere (lecture slide 49).
uniform vec3 u_viewer;

vec3 viewer(vec3 p) {
    return u_viewer;
}
