#include "math/constants.glsl"
#include "surface/frame.glsl"

// The same distribution from the sine of the angle between normal and half vector, which has all digits of a small angle.
struct TextbookGgx {
    float width;  // [0.0005, 0.01] default 0.001: width of the highlight
};

vec3 brdf_cos(TextbookGgx m, Frame f, vec3 l, vec3 v) {
    vec3 h = normalize(l + v);
    float NoH = dot(f.n, h);
    vec3 s = cross(f.n, h);
    float a2 = m.width * m.width;
    float t = NoH * NoH * a2 + dot(s, s);
    float d = a2 / (PI * t * t);
    float NoL = dot(f.n, l);
    return NoL > 0.0 ? vec3(d * NoL) : vec3(0.0);
}
