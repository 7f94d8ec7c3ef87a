#include "lib/constants.glsl"
#include "lib/frame.glsl"
#include "lobe/smith_separate.glsl"

// Burley 2012, sections 5.4 and 5.6: D G F / (4 n.l n.v) of the clear coat, times n.l: a quarter of the generalised
// Trowbridge-Reitz distribution with exponent 1, F0 = 0.04 (ior 1.5), and shadowing of the fixed width 1/4.
// D = (1 - alpha^2) / (-pi ln(alpha^2) (alpha^2 cos^2 + sin^2)), alpha from 0.1 at gloss 0 to 0.001 at gloss 1.
float clearcoat(Frame f, vec3 h, float NoL, float NoV, float fh, float weight, float gloss) {
    // Not by mix(): 0.1 - 0.099 gloss has lost two digits at gloss 1.
    float a = 0.1 * (1.0 - gloss) + 0.001 * gloss;
    float a2 = a * a;
    // sin^2 from h - n, of near vectors exact.
    vec3 d = h - f.n;
    float s = 0.5 * dot(d, d);
    float q = a2 + (1.0 - a2) * (s * (2.0 - s));
    float D = (a2 - 1.0) * INV_PI / (2.0 * log(a) * q);
    float V = smith_separate(NoL, 0.25) * smith_separate(NoV, 0.25);
    return 0.25 * weight * (0.04 + 0.96 * fh) * D * V * NoL;
}
