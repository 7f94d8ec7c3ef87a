#include "lib/frame.glsl"

// Reflects ambient light alone (lecture slide 23): a constant colour, whatever else shines.
struct Ambient {
    vec3 ka;
};

vec3 brdf_cos(Ambient m, Frame f, vec3 l, vec3 v) {
    return vec3(0.0);
}

vec3 ambient_reflectance(Ambient m) {
    return m.ka;
}
