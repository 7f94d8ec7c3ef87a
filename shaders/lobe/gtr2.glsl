#include "lobe/smith_separate.glsl"

// The shadowing of the base layer's highlight in Disney's model. LEAST_ALPHA is the smallest width in Burley's implementation.
const float LEAST_ALPHA = 0.001;

// Returns G / (4 n.l n.v) for the shadowing G of Burley 2012, section 5.6. The width of G is at least 1/4, so that smooth
// surfaces do not get too bright at grazing angles, and G is the same in all directions.
float gtr2_visible(float NoL, float NoV, float roughness) {
    float alpha = 0.5 + 0.5 * roughness;
    alpha *= alpha;
    return smith_separate(NoL, alpha) * smith_separate(NoV, alpha);
}
