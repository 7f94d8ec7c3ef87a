#include "lib/constants.glsl"

// a + i b = sqrt((eta + i k)^2 - sin^2), cosine c: the normal part of the wave inside a conductor of index eta + i k.
// a^2 - b^2 = eta^2 - sin^2 - k^2 and a b = eta k: the larger of a, b from a sum, the other by division, so nothing cancels.
void conductor(vec3 eta, vec3 k, float c, float sin2, out vec3 a, out vec3 b) {
    // Of small eta^2 and sin^2, or of an index near 1, the digits.
    vec3 small = eta * eta - sin2;
    vec3 difference = mix((eta - 1.0) * (eta + 1.0) + c * c, small, lessThan(eta, vec3(0.5))) - k * k;
    vec3 ab = eta * k;
    vec3 larger = sqrt(0.5 * (abs(difference) + sqrt(difference * difference + 4.0 * ab * ab)));
    vec3 smaller = ab / max(larger, FLT_MIN);
    bvec3 positive = greaterThan(difference, vec3(0.0));
    a = mix(smaller, larger, positive);
    b = mix(larger, smaller, positive);
}
