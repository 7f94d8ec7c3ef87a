#include "lobe/interface_exact.glsl"
#include "microfacet/ggx_isotropic.glsl"

// The light that the clear coat of paint reflects, times n.l: GGX (Walter et al. 2007) with Fresnel's formulas.
float coat_gloss(Paint m, Frame f, vec3 l, vec3 v, vec3 h, float LoH) {
    return m.coat * interface_reflects(LoH, max(m.ior, 1.0)) * ggx_cos(f, l, v, h, m.coat_roughness, 0.0);
}

// The share of light that passes through the clear coat on the way in and on the way out.
float coat_passes(Paint m, float NoL, float NoV) {
    float ior = max(m.ior, 1.0);
    float bare = 1.0 - m.coat;
    return (bare + m.coat * interface_passes(NoL, ior)) * (bare + m.coat * interface_passes(NoV, ior));
}
