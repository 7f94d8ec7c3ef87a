#include "math/constants.glsl"
#include "surface/frame.glsl"

// Lambert's model, ideal diffuse reflection (lecture slides 13-15): kd/pi n.l, and 0 from below the surface.
struct Lambert {
    vec3 kd;
};

vec3 brdf_cos(Lambert m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    return m.kd * (NoL > 0.0 && dot(f.n, v) > 0.0 ? INV_PI * NoL : 0.0);
}

vec3 ambient_reflectance(Lambert m) {
    return m.kd;
}
