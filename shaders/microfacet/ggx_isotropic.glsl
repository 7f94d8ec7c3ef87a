#include "lib/constants.glsl"
#include "lib/frame.glsl"
#include "microfacet/microfacet_alpha.glsl"

// GGX: D V n.l [1/sr], V = G2 / (4 n.l n.v), G2 Smith's, height-correlated (Walter et al. 2007, eq. 33; Heitz 2014, eq. 99).
// The same arguments as in ggx_anisotropic.glsl, so that a slot can choose; f.t, f.b and anisotropy are not looked at.
// h: (l + v) / |l + v|. Finite for any l, v, h; what is below the horizon is for the caller to leave out.
// The cosine is in it because V alone overflows where both directions graze.
float ggx_cos(Frame f, vec3 l, vec3 v, vec3 h, float roughness, float anisotropy) {
    float a = microfacet_alpha(roughness);
    float a2 = a * a;
    float rest = (1.0 - a) * (1.0 + a);
    // alpha^2 cos^2 + sin^2 has its digits only if sin^2 has: from h - n, of near vectors exact.
    vec3 d = h - f.n;
    float s = 0.5 * dot(d, d);
    float q = a2 + rest * (s * (2.0 - s));
    float NoL = dot(f.n, l);
    float NoV = dot(f.n, v);
    float gl = sqrt(a2 + rest * (NoL * NoL));
    float gv = sqrt(a2 + rest * (NoV * NoV));
    return 0.5 * INV_PI * a2 / (q * q) * (NoL / max(NoL * gv + NoV * gl, FLT_MIN));
}
