#include "math/constants.glsl"
#include "surface/frame.glsl"
#include "microfacet/microfacet_alpha.glsl"

// Isotropic GGX: its distribution D of microfacet normals times V n.l [1/sr]. V = G2 / (4 n.l n.v), and G2 is Smith's
// height-correlated shadowing (Walter et al. 2007, eq. 33; Heitz 2014, eq. 99). The function has the signature of the one in
// ggx_anisotropic.glsl, so that a material can choose between them; f.t, f.b and anisotropy are not used.
// h is (l + v) / |l + v|. The result is finite for any l, v and h; the caller excludes directions below the horizon. The
// function includes n.l, because V alone overflows where both directions graze.
float ggx_cos(Frame f, vec3 l, vec3 v, vec3 h, float roughness, float anisotropy) {
    float a = microfacet_alpha(roughness);
    float a2 = a * a;
    float rest = (1.0 - a) * (1.0 + a);
    // q = alpha^2 cos^2 + sin^2 of the angle between n and h. sin^2 comes from h - n, which is exact for nearly equal vectors.
    vec3 d = h - f.n;
    float s = 0.5 * dot(d, d);
    float q = a2 + rest * (s * (2.0 - s));
    float NoL = dot(f.n, l);
    float NoV = dot(f.n, v);
    float gl = sqrt(a2 + rest * (NoL * NoL));
    float gv = sqrt(a2 + rest * (NoV * NoV));
    return 0.5 * INV_PI * a2 / (q * q) * (NoL / max(NoL * gv + NoV * gl, FLT_MIN));
}
