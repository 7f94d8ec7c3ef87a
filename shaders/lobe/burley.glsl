#include "lib/constants.glsl"

// Burley 2012, section 5.3, times n.l: the diffuse lobe of reflectance 1. Fresnel's darkening at grazing angles is turned round
// towards the light by roughness. The square of l.h is |l + v|^2 / 4.
float burley(float roughness, float NoL, float NoV, float LoH2) {
    float rise = 2.0 * roughness * LoH2 - 0.5;  // F_D90 - 1
    float a = 1.0 - NoL;
    float b = 1.0 - NoV;
    float a2 = a * a;
    float b2 = b * b;
    return INV_PI * NoL * (1.0 + rise * (a2 * a2 * a)) * (1.0 + rise * (b2 * b2 * b));
}
