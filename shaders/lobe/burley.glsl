#include "math/constants.glsl"

// The diffuse lobe of Burley 2012, section 5.3, for reflectance 1, times n.l. Fresnel reflection makes smooth surfaces darker
// at grazing angles; rough ones are brighter toward the light. LoH2 = (l.h)^2 = |l + v|^2 / 4.
float burley_diffuse(float roughness, float NoL, float NoV, float LoH2) {
    float rise = 2.0 * roughness * LoH2 - 0.5;  // F_D90 - 1
    float a = 1.0 - NoL;
    float b = 1.0 - NoV;
    float a2 = a * a;
    float b2 = b * b;
    return INV_PI * NoL * (1.0 + rise * (a2 * a2 * a)) * (1.0 + rise * (b2 * b2 * b));
}
