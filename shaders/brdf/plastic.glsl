#include "lib/constants.glsl"
#include "lib/frame.glsl"
#include "microfacet/ggx_isotropic.glsl"
#include <interface>

// A colourless rough dielectric over a diffuse base, times n.l: D V F(l.h) with GGX (Walter et al. 2007), and
// kd/pi (1 - F(n.l)) (1 - F(n.v)) / (eta^2 (1 - kd F_inside)) of light that goes in, between base and surface any number of
// times, and out (Wolff 1994 and Jakob 2010, without the roughness of the surface). eta^2 (1 - F_inside) = 1 - F_outside.
struct Plastic {
    vec3 kd;
    float ior;
    float roughness;
};

vec3 brdf_cos(Plastic m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    float NoV = dot(f.n, v);
    vec3 H = l + v;
    // |H|^2 below 1e-12: l = -v to rounding, where no half vector is.
    float H2 = dot(H, H);
    float inverse_H = inversesqrt(max(H2, 1e-12));
    float LoH = min(0.5 * H2 * inverse_H, 1.0);  // l.h = |H| / 2
    // A texture may be darker than any index.
    float ior = max(m.ior, 1.0);
    bool lit = NoL > 0.0 && NoV > 0.0;
    float gloss = ggx_cos(f, l, v, H * inverse_H, m.roughness, 0.0) * interface_reflects(LoH, ior);
    float through = interface_passes(NoL, ior) * interface_passes(NoV, ior) * (INV_PI * NoL);
    vec3 base = m.kd / (ior * ior * (1.0 - m.kd) + m.kd * (1.0 - interface_diffuse(ior)));
    return base * (lit ? through : 0.0) + (lit && H2 > 1e-12 ? gloss : 0.0);
}

vec3 ambient_reflectance(Plastic m) {
    return m.kd;
}
