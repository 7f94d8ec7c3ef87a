#include "surface/frame.glsl"

// The model that reflects only ambient light (lecture slide 23), in a constant colour.
struct Ambient {
    vec3 ka;
};

vec3 brdf_cos(Ambient m, Frame f, vec3 l, vec3 v) {
    return vec3(0.0);
}

vec3 ambient_reflectance(Ambient m) {
    return m.ka;
}
