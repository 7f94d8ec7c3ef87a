#include "surface/frame.glsl"

// A spherical Gaussian about the mirror direction (Wang et al. 2009, eq. 1), whose 1 - cos is written as it is read.
struct SphericalGaussian {
    float sharpness;  // [100, 1000000] default 10000: sharpness of the lobe
};

vec3 brdf_cos(SphericalGaussian m, Frame f, vec3 l, vec3 v) {
    vec3 r = reflect(-v, f.n);  // loses digits
    float x = 1.0 - dot(r, l);  // loses digits
    float NoL = dot(f.n, l);
    return NoL > 0.0 ? vec3(exp(-m.sharpness * x) * NoL) : vec3(0.0);
}
