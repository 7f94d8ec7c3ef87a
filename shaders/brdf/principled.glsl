#include "surface/frame.glsl"

// Disney's principled model as published in Burley 2012, section 5, with isotropic, separable shadowing of width
// (1/2 + roughness/2)^2, which later revisions changed. kd is the linear base colour.
struct Principled {
    vec3 kd;
    float metallic;
    float subsurface;
    float specular;
    float roughness;
    float specular_tint;
    float anisotropy;
    float sheen;
    float sheen_tint;
    float clearcoat;
    float clearcoat_gloss;
};

// The generated code has the lobes whose weight is not zero, and principled_cos, which adds them up. Its argument fh is
// (1 - l.h)^5, and facet is 0 where there is no half vector, else 1.
#include <lobes>

vec3 brdf_cos(Principled m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    float NoV = dot(f.n, v);
    vec3 H = l + v;
    // Below 1e-12, |H|^2 is only a rounding error: l is -v, and there is no half vector.
    float H2 = dot(H, H);
    float inverse_H = inversesqrt(max(H2, 1e-12));
    float x = 1.0 - min(0.5 * H2 * inverse_H, 1.0);  // l.h = |H| / 2
    float x2 = x * x;
    float facet = H2 > 1e-12 ? 1.0 : 0.0;
    bool lit = NoL > 0.0 && NoV > 0.0;
    return lit ? principled_cos(m, f, H * inverse_H, NoL, NoV, 0.25 * H2, x2 * x2 * x, facet) : vec3(0.0);
}

vec3 ambient_reflectance(Principled m) {
    return m.kd;
}
