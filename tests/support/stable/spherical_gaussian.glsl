#include "surface/frame.glsl"

// The same lobe; 1 - cos is half the squared distance of the two unit vectors.
struct SphericalGaussian {
    float sharpness;  // [100, 1000000] default 10000: sharpness of the lobe
};

vec3 brdf_cos(SphericalGaussian m, Frame f, vec3 l, vec3 v) {
    vec3 q = reflect(-v, f.n) - l;
    float x = 0.5 * dot(q, q);
    float NoL = dot(f.n, l);
    return NoL > 0.0 ? vec3(exp(-m.sharpness * x) * NoL) : vec3(0.0);
}
