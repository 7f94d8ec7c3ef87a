#include "surface/frame.glsl"

// The lobe of Blinn 1977: a high power of a cosine near 1 has no more digits than 1 - cos has.
struct PowerOfCosine {
    float exponent;  // [100, 100000] default 1000: shininess
};

vec3 brdf_cos(PowerOfCosine m, Frame f, vec3 l, vec3 v) {
    float NoH = max(dot(f.n, normalize(l + v)), 0.0);  // loses digits
    float lobe = pow(NoH, m.exponent);  // loses digits
    float NoL = dot(f.n, l);
    return NoL > 0.0 ? vec3(lobe * NoL) : vec3(0.0);
}
