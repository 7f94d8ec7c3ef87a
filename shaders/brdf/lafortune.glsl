#include "math/constants.glsl"
#include "surface/frame.glsl"
#include "math/log1m.glsl"
#include <axes>

// The model of Lafortune, Foo, Torrance and Greenberg 1997 with up to three lobes:
// (kd/pi + sum of ks (p + 2)/(2 pi) max(cx lx vx + cy ly vy + cz lz vz, 0)^p) n.l. p is the exponent; |cx|, |cy| and |cz| <= 1.
struct Lafortune {
    vec3 kd;
    vec3 ks_1;
    float cx_1;
    float cy_1;
    float cz_1;
    float exponent_1;
    vec3 ks_2;
    float cx_2;
    float cy_2;
    float cz_2;
    float exponent_2;
    vec3 ks_3;
    float cx_3;
    float cy_3;
    float cz_3;
    float exponent_3;
};

// Returns one lobe without its colour and without 1/pi: max(c.products, 0)^p (p + 2) / 2.
float lobe(Axes x, vec3 c, float p) {
    vec3 size = abs(c);
    // s is 1 - c.products without cancellation, as a sum of terms that are not negative.
    float s = 0.5 * dot(size, vec3(c.x < 0.0 ? x.sums.x : x.differences.x, c.y < 0.0 ? x.sums.y : x.differences.y,
                                   c.z < 0.0 ? x.sums.z : x.differences.z)) +
              0.5 * dot(1.0 - size, x.squares);
    float base = dot(c, x.products);
    float log_base = s < 0.25 ? s * log1m_over(s) : log(clamp(base, FLT_MIN, 1.0));
    // The square root of the lobe is squared last: its tail would be flushed to 0 before the factor in p makes it large again.
    float root = s < 0.25 || base > 0.0 ? exp(0.5 * p * log_base) : 0.0;
    return (0.5 * p + 1.0) * root * root;
}

// The generated function lobes() adds up the lobes whose weight is not zero.
#include <lobes>

vec3 brdf_cos(Lafortune m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    float lit = NoL > 0.0 && dot(f.n, v) > 0.0 ? INV_PI * NoL : 0.0;
    return m.kd * lit + lobes(m, axes(f, l, v)) * lit;
}

vec3 ambient_reflectance(Lafortune m) {
    return m.kd;
}
