#include "lib/fresnel.glsl"
#include "microfacet/ggx_isotropic.glsl"

// Metal flakes that lie nearly flat: GGX (Walter et al. 2007) and Schlick's Fresnel, times n.l.
vec3 flakes(Paint m, Frame f, vec3 l, vec3 v, vec3 h, float LoH) {
    return f_schlick(m.flake_colour, LoH) * (m.flakes * ggx_cos(f, l, v, h, m.flake_roughness, 0.0));
}
