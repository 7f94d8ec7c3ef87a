#include "lib/constants.glsl"
#include "lib/frame.glsl"
#include "lib/log1m.glsl"
#include <axes>

// Lafortune, Foo, Torrance and Greenberg 1997:
// (kd/pi + sum of ks (p + 2)/(2 pi) max(cx lx vx + cy ly vy + cz lz vz, 0)^p) n.l, with |c| at most 1 in each axis.
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

// max(c.products, 0)^p (p + 2) / 2.
float lobe(Axes x, vec3 c, float p) {
    vec3 size = abs(c);
    // 1 - c.products without its cancellation, as a sum of what is not negative.
    float s = 0.5 * dot(size, vec3(c.x < 0.0 ? x.sums.x : x.differences.x, c.y < 0.0 ? x.sums.y : x.differences.y,
                                   c.z < 0.0 ? x.sums.z : x.differences.z)) +
              0.5 * dot(1.0 - size, x.squares);
    float base = dot(c, x.products);
    float log_base = s < 0.25 ? s * log1m_over(s) : log(clamp(base, FLT_MIN, 1.0));
    // The lobe's root, squared in the end: its tail would vanish below FLT_MIN before p makes it large again.
    float root = s < 0.25 || base > 0.0 ? exp(0.5 * p * log_base) : 0.0;
    return (0.5 * p + 1.0) * root * root;
}

#include <lobes>

vec3 brdf_cos(Lafortune m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    float lit = NoL > 0.0 && dot(f.n, v) > 0.0 ? INV_PI * NoL : 0.0;
    return m.kd * lit + lobes(m, axes(f, l, v)) * lit;
}

vec3 ambient_reflectance(Lafortune m) {
    return m.kd;
}
