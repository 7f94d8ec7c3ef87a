#include "math/constants.glsl"
#include "surface/frame.glsl"

// The distribution of microfacets of Walter et al. 2007, eq. 33, as textbooks print it: 1 - cos^2 cancels near the normal.
struct TextbookGgx {
    float width;  // [0.0005, 0.01] default 0.001: width of the highlight
};

vec3 brdf_cos(TextbookGgx m, Frame f, vec3 l, vec3 v) {
    vec3 h = normalize(l + v);  // loses digits
    float NoH = dot(f.n, h);  // loses digits
    float a2 = m.width * m.width;
    float t = NoH * NoH * (a2 - 1.0) + 1.0;  // loses digits
    float d = a2 / (PI * t * t);
    float NoL = dot(f.n, l);
    return NoL > 0.0 ? vec3(d * NoL) : vec3(0.0);
}
