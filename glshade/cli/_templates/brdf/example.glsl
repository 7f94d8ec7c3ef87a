#include "math/constants.glsl"
#include "surface/frame.glsl"

// Diffuse reflection that fades toward the outline: kd/pi (1 - fade + fade (n.l)(n.v)).
struct Example {
    vec3 kd;
    float fade;
};

vec3 brdf_cos(Example m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    float NoV = dot(f.n, v);
    float faded = 1.0 - m.fade + m.fade * NoL * NoV;
    return NoL > 0.0 && NoV > 0.0 ? m.kd * (INV_PI * faded * NoL) : vec3(0.0);
}

vec3 ambient_reflectance(Example m) {
    return m.kd;
}
