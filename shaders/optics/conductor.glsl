#include "math/constants.glsl"

// The normal component of the wave vector inside a conductor of index eta + i k: a + i b = sqrt((eta + i k)^2 - sin^2). c is
// the cosine, and sin2 the squared sine, of the angle outside. From a^2 - b^2 = eta^2 - sin^2 - k^2 and a b = eta k, the larger
// of a and b is computed by a sum and the other one by a division, so that nothing cancels.
void conductor(vec3 eta, vec3 k, float c, float sin2, out vec3 a, out vec3 b) {
    // eta^2 - sin^2 has two forms: `small` keeps the digits of a small index, the other one those of an index near 1.
    vec3 small = eta * eta - sin2;
    vec3 difference = mix((eta - 1.0) * (eta + 1.0) + c * c, small, lessThan(eta, vec3(0.5))) - k * k;
    vec3 ab = eta * k;
    vec3 larger = sqrt(0.5 * (abs(difference) + sqrt(difference * difference + 4.0 * ab * ab)));
    vec3 smaller = ab / max(larger, FLT_MIN);
    bvec3 positive = greaterThan(difference, vec3(0.0));
    a = mix(smaller, larger, positive);
    b = mix(larger, smaller, positive);
}
