#include "optics/f_schlick.glsl"
#include "microfacet/ggx_isotropic.glsl"

// The metal flakes of paint, which lie nearly flat, times n.l: GGX (Walter et al. 2007) with Schlick's Fresnel term.
vec3 flakes(Paint m, Frame f, vec3 l, vec3 v, vec3 h, float LoH) {
    return f_schlick(m.flake_colour, LoH) * (m.flakes * ggx_cos(f, l, v, h, m.flake_roughness, 0.0));
}
