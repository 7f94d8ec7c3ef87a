#include "surface/frame.glsl"

// Fresnel's reflectance of a conductor as it is usually printed, by differences of terms that are nearly equal where the index
// is near 1.
struct ConductorBySubtraction {
    vec3 eta;  // [1, 3] default 1.5: index of refraction
    vec3 k;    // [0, 5] default 0: index of absorption
};

vec3 brdf_cos(ConductorBySubtraction m, Frame f, vec3 l, vec3 v) {
    float c = max(dot(f.n, v), 0.0);
    float c2 = c * c;  // loses digits
    float s2 = 1.0 - c2;
    vec3 t0 = m.eta * m.eta - m.k * m.k - s2;
    vec3 a2b2 = sqrt(t0 * t0 + 4.0 * m.eta * m.eta * m.k * m.k);  // loses digits
    vec3 a = sqrt(max(0.5 * (a2b2 + t0), 0.0));  // loses digits
    vec3 rs = (a2b2 + c2 - 2.0 * a * c) / (a2b2 + c2 + 2.0 * a * c);  // loses digits
    vec3 t3 = c2 * a2b2 + s2 * s2;
    vec3 t4 = 2.0 * a * c * s2;
    vec3 rp = rs * (t3 - t4) / max(t3 + t4, 1e-30);
    float NoL = dot(f.n, l);
    return NoL > 0.0 ? 0.5 * (rs + rp) * NoL : vec3(0.0);
}
