#include "math/constants.glsl"
#include "surface/frame.glsl"
#include "lobe/smith_separate.glsl"

// The clear coat of Burley 2012, sections 5.4 and 5.6, times n.l: a quarter of D G F / (4 n.l n.v). D is the generalised
// Trowbridge-Reitz distribution with exponent 1, D = (1 - alpha^2) / (-pi ln(alpha^2) (alpha^2 cos^2 + sin^2)), with alpha from
// 0.1 at gloss 0 to 0.001 at gloss 1. F has F0 = 0.04 (ior 1.5), and G is shadowing of the fixed width 1/4.
float clearcoat(Frame f, vec3 h, float NoL, float NoV, float fh, float weight, float gloss) {
    // mix() may compute 0.1 - 0.099 gloss, which loses two digits at gloss 1. A compiler may turn 0.1 (1 - gloss) + 0.001 gloss
    // into mix(), but not this form.
    float a = 0.001 + 0.099 * (1.0 - gloss);
    float a2 = a * a;
    // sin^2 comes from h - n, which is exact for nearly equal vectors.
    vec3 d = h - f.n;
    float s = 0.5 * dot(d, d);
    float q = a2 + (1.0 - a2) * (s * (2.0 - s));
    float D = (a2 - 1.0) * INV_PI / (2.0 * log(a) * q);
    float V = smith_separate(NoL, 0.25) * smith_separate(NoV, 0.25);
    return 0.25 * weight * (0.04 + 0.96 * fh) * D * V * NoL;
}
