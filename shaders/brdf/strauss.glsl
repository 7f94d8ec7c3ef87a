#include "math/arcsine.glsl"
#include "math/constants.glsl"
#include "math/cospow.glsl"
#include "surface/frame.glsl"

// The model of Strauss 1990: (n.l (1 - m s) (1 - s^3) kd + max(r.v, 0)^(3 / (1 - s)) R C) / pi with smoothness s and metalness
// m. R is `reflectivity` and C is `colour` below. Its Fresnel and geometric terms take angles; published shaders that pass
// cosines to them reverse their effect (erratum).
struct Strauss {
    vec3 kd;
    float smoothness;
    float metalness;
};

// The generated code has strauss_diffuse, which is 0 where the material has no diffuse lobe.
#include <diffuse>

// The constants of Strauss 1990; KF and KG are his values minus 1. So his 1.12 - angle / 90 degrees becomes KF + height, which
// does not cancel.
const float KF = 0.12;
const float KG = 0.01;
const float KJ = 0.1;

// The angle between d and n, and the angle between d and the horizon, both in units of 90 degrees. The smaller one is computed
// first, so that both keep their digits.
vec2 angles(vec3 n, vec3 d) {
    float cosine = max(dot(n, d), 0.0);
    vec3 q = n - d;
    bool low = cosine < 0.7;
    float angle = 2.0 * INV_PI * arcsine(low ? cosine : 0.5 * sqrt(dot(q, q)));
    return low ? vec2(1.0 - angle, angle) : vec2(2.0 * angle, 1.0 - 2.0 * angle);
}

// The geometric term, from the angle to the horizon in units of 90 degrees.
float geometry(float height) {
    float x = height + KG;
    return height * (height + 2.0 * KG) / (x * x) * ((1.0 + KG) * (1.0 + KG) / (1.0 + 2.0 * KG));
}

vec3 brdf_cos(Strauss m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    float NoV = dot(f.n, v);
    float s = m.smoothness;
    float smooth3 = s * s * s;
    vec2 of_l = angles(f.n, l);
    float x = of_l.y + KF;
    float fresnel = of_l.x * (x + 1.0 + KF) / (x * x) * (KF * KF / (1.0 + 2.0 * KF));
    float raised = fresnel * geometry(of_l.y) * geometry(angles(f.n, v).y);
    float reflectivity = min(smooth3 + (smooth3 + KJ) * raised, 1.0);
    // The exponent has its pole at s = 1.
    float lobe = cospow(2.0 * NoV * f.n - v, l, 3.0 / max(1.0 - s, 3e-8)) * reflectivity;
    // C = 1 + m (F - 1) (1 - kd), with the Fresnel term F, as a sum of terms that are not negative.
    vec3 colour = m.kd * (m.metalness * (1.0 - fresnel)) + (1.0 - m.metalness + m.metalness * fresnel);
    float lit = NoL > 0.0 && NoV > 0.0 ? INV_PI : 0.0;
    return m.kd * (lit * strauss_diffuse(m, NoL)) + colour * (lit * lobe);
}

vec3 ambient_reflectance(Strauss m) {
    float s = m.smoothness;
    return m.kd * ((1.0 - s) * (1.0 + s + s * s));
}
