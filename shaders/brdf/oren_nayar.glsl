#include "math/right_angles.glsl"
#include "math/constants.glsl"
#include "surface/frame.glsl"

// The model of Oren and Nayar 1994, eqs. 27-30, times n.l. It adds L1, the direct term with C1, C2 and C3, and L2, the
// inter-reflection term. Negative sums of L1 and L2 count as 0.
struct OrenNayar {
    vec3 kd;
    float sigma;
};

vec3 brdf_cos(OrenNayar m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    float NoV = dot(f.n, v);
    // The projections of l and v onto the surface: their lengths are the sines of the angles to n, and their dot product is
    // sin sin cos(dphi). All are precise even for l = n or v = n.
    vec3 l_level = l - NoL * f.n;
    vec3 v_level = v - NoV * f.n;
    float product = dot(l_level, v_level);
    float sin_l = length(l_level);
    float sin_v = length(v_level);
    // At l = n or v = n the azimuth is undefined, but the factors of cos(dphi) are 0 there. 1 - |cos(dphi)| must be precise
    // where it is small, so it is computed from the sine: sin^2 / (1 + |cos|).
    float inverse = 1.0 / max(sin_l * sin_v, FLT_MIN);
    float cos_dphi = clamp(product * inverse, -1.0, 1.0);
    float sin_dphi = dot(f.n, cross(l_level, v_level)) * inverse;
    float sideways = min(sin_dphi * sin_dphi / (1.0 + abs(cos_dphi)), 1.0);
    // alpha is the larger of the angles of l and v to n, beta the smaller one.
    bool l_lower = NoL < NoV;
    float cos_alpha = max(l_lower ? NoL : NoV, 0.0);
    float cos_beta = max(l_lower ? NoV : NoL, FLT_MIN);
    float sin_alpha = l_lower ? sin_l : sin_v;
    float sin_beta = l_lower ? sin_v : sin_l;
    // These are 1 - 2 alpha/pi and 1 - 2 beta/pi, computed as angles to the horizon, so that the differences below lose no
    // digits.
    float up_alpha = right_angles(cos_alpha, sin_alpha);
    float up_beta = right_angles(cos_beta, sin_beta);
    float s2 = m.sigma * m.sigma;
    float c1 = 1.0 - 0.5 * s2 / (s2 + 0.33);
    float c2 = 0.45 * s2 / (s2 + 0.09);
    float c3 = 0.125 * s2 / (s2 + 0.09);
    float c4 = 0.17 * s2 / (s2 + 0.13);
    // `toward` is n.l cos(dphi) tan(beta) sin(alpha). Where cos(dphi) < 0, sin(alpha) is replaced by
    // sin(alpha) - (2 beta/pi)^3, computed as (1 - (2 beta/pi)^3) - (1 - sin(alpha)). NoL / cos(beta) and
    // NoL / (cos(alpha) + cos(beta)) are never above 1.
    float cubed = up_beta * (3.0 - up_beta * (3.0 - up_beta));
    float less = (cubed - cos_alpha * cos_alpha / (1.0 + sin_alpha)) / max(sin_alpha, FLT_MIN);
    float toward = NoL / cos_beta * product * (product >= 0.0 ? 1.0 : less);
    // `across` contains tan((alpha + beta) / 2) = (sin(alpha) + sin(beta)) / (cos(alpha) + cos(beta)).
    float across = sideways * (sin_alpha + sin_beta) * (NoL / (cos_alpha + cos_beta));
    float angles = (1.0 - up_alpha) * (1.0 - up_beta);
    float beta2 = (1.0 - up_beta) * (1.0 - up_beta);
    float one = c1 * NoL + c2 * toward + c3 * (angles * angles) * across;
    float two = c4 * (1.0 - cos_dphi * beta2) * NoL;
    bool lit = NoL > 0.0 && NoV > 0.0;
    return INV_PI * m.kd * max(lit ? one + m.kd * two : vec3(0.0), 0.0);
}

vec3 ambient_reflectance(OrenNayar m) {
    return m.kd;
}
