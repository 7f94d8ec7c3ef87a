#include "math/constants.glsl"
#include "surface/frame.glsl"

// Car paint, times n.l: pigment (ideal diffuse) and metal flakes (GGX, Walter et al. 2007, with Schlick's Fresnel term) under a
// clear coat (GGX with the exact Fresnel term F), which dims them by 1 - coat F on the way in and on the way out.
struct Paint {
    vec3 kd;
    vec3 flake_colour;
    float flakes;
    float flake_roughness;
    float coat;
    float ior;
    float coat_roughness;
};

// The generated code has the lobes whose weight is not zero, and paint_cos, which adds them up. h is invalid where there is no
// half vector.
#include <lobes>

vec3 brdf_cos(Paint m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    float NoV = dot(f.n, v);
    vec3 H = l + v;
    // Below 1e-12, |H|^2 is only a rounding error: l is -v, and there is no half vector.
    float H2 = dot(H, H);
    float inverse_H = inversesqrt(max(H2, 1e-12));
    float LoH = min(0.5 * H2 * inverse_H, 1.0);  // l.h = |H| / 2
    return NoL > 0.0 && NoV > 0.0 ? paint_cos(m, f, l, v, H * inverse_H, NoL, NoV, LoH, H2 > 1e-12 ? 1.0 : 0.0) : vec3(0.0);
}

vec3 ambient_reflectance(Paint m) {
    return mix(m.kd, m.flake_colour, m.flakes);
}
