#include "math/cospow.glsl"
#include "surface/frame.glsl"

// The same power, computed from the difference of the two unit vectors.
struct PowerOfCosine {
    float exponent;  // [100, 100000] default 1000: shininess
};

vec3 brdf_cos(PowerOfCosine m, Frame f, vec3 l, vec3 v) {
    float lobe = cospow(f.n, normalize(l + v), m.exponent);
    float NoL = dot(f.n, l);
    return NoL > 0.0 ? vec3(lobe * NoL) : vec3(0.0);
}
