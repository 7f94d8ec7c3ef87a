#include "surface/frame.glsl"
#include "lobe/burley.glsl"

// The diffuse model of Burley 2012, section 5.3: kd/pi (1 + (F90 - 1)(1 - n.l)^5) (1 + (F90 - 1)(1 - n.v)^5) n.l with
// F90 = 1/2 + 2 roughness (l.h)^2.
struct Burley {
    vec3 kd;
    float roughness;
};

vec3 brdf_cos(Burley m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    float NoV = dot(f.n, v);
    vec3 H = l + v;
    return m.kd * (NoL > 0.0 && NoV > 0.0 ? burley_diffuse(m.roughness, NoL, NoV, 0.25 * dot(H, H)) : 0.0);
}

vec3 ambient_reflectance(Burley m) {
    return m.kd;
}
