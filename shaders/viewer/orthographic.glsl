uniform vec3 u_viewer;

// A viewer at infinity: v is constant (lecture slide 49).
vec3 viewer(vec3 p) {
    return u_viewer;
}
