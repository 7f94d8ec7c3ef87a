#include "lobe/interface_exact.glsl"
#include "microfacet/ggx_isotropic.glsl"

// What the clear coat reflects: GGX (Walter et al. 2007) and Fresnel's formulas, times n.l.
float coat_gloss(Paint m, Frame f, vec3 l, vec3 v, vec3 h, float LoH) {
    return m.coat * interface_reflects(LoH, max(m.ior, 1.0)) * ggx_cos(f, l, v, h, m.coat_roughness, 0.0);
}

// What gets through it, in and out.
float coat_passes(Paint m, float NoL, float NoV) {
    float ior = max(m.ior, 1.0);
    float bare = 1.0 - m.coat;
    return (bare + m.coat * interface_passes(NoL, ior)) * (bare + m.coat * interface_passes(NoV, ior));
}
