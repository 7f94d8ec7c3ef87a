#include "math/constants.glsl"
#include "surface/frame.glsl"
#include "microfacet/ggx_isotropic.glsl"
#include <interface>

// A colourless rough dielectric over a diffuse base, times n.l. The surface reflects D V F(l.h) with GGX (Walter et al. 2007)
// and the Fresnel term F. Light that enters, is reflected between base and surface any number of times and leaves again adds
// kd/pi (1 - F(n.l)) (1 - F(n.v)) / (eta^2 (1 - kd F_inside)) (Wolff 1994 and Jakob 2010, without the roughness of the
// surface), where eta^2 (1 - F_inside) = 1 - F_outside.
struct Plastic {
    vec3 kd;
    float ior;
    float roughness;
};

vec3 brdf_cos(Plastic m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    float NoV = dot(f.n, v);
    vec3 H = l + v;
    // Below 1e-12, |H|^2 is only a rounding error: l is -v, and there is no half vector.
    float H2 = dot(H, H);
    float inverse_H = inversesqrt(max(H2, 1e-12));
    float LoH = min(0.5 * H2 * inverse_H, 1.0);  // l.h = |H| / 2
    // A texture may hold values below 1, which are no valid refractive index.
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
