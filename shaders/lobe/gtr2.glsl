#include "lobe/smith_separate.glsl"

// The narrowest highlight of Burley's reference implementation.
const float LEAST_ALPHA = 0.001;

// Burley 2012, section 5.6: G / (4 n.l n.v). The width is kept large, so that smooth surfaces do not gain too much at grazing
// angles, and alike in all directions.
float gtr2_visible(float NoL, float NoV, float roughness) {
    float alpha = 0.5 + 0.5 * roughness;
    alpha *= alpha;
    return smith_separate(NoL, alpha) * smith_separate(NoV, alpha);
}
