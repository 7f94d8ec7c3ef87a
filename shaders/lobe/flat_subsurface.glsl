#include "math/constants.glsl"

// The subsurface lobe of Burley 2012, section 5.3, for reflectance 1, times n.l: 1.25/pi (Fss (1/(n.l + n.v) - 1/2) + 1/2) n.l.
// `fss` below is Fss. The lobe approximates the flat lobe of Hanrahan and Krueger 1993 for light scattered below the surface.
// It is finite where both directions graze, because n.l/(n.l + n.v) <= 1.
float flat_subsurface(float roughness, float NoL, float NoV, float LoH2) {
    float rise = roughness * LoH2 - 1.0;  // F_ss90 - 1
    float a = 1.0 - NoL;
    float b = 1.0 - NoV;
    float a2 = a * a;
    float b2 = b * b;
    float fss = (1.0 + rise * (a2 * a2 * a)) * (1.0 + rise * (b2 * b2 * b));
    return 1.25 * INV_PI * (fss * (NoL / max(NoL + NoV, FLT_MIN) - 0.5 * NoL) + 0.5 * NoL);
}
