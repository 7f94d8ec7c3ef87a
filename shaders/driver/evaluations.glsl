// Evaluates a model many times, to time it. The directions change from round to round and differ from pixel to pixel, so that
// the compiler cannot move an evaluation out of the loop and neighbouring pixels cannot share one.
#include "surface/frame.glsl"
#include <model>

uniform int u_count;
// A tiny number that the compiler does not know. Without it the directions would repeat every few rounds.
uniform vec3 u_drift;

vec3 evaluations(vec2 place) {
    // All components are positive and the normal points along their diagonal, so both directions stay above the horizon.
    vec3 n = normalize(vec3(0.8) + 0.4 * fract(place.yxx * vec3(0.713, 0.137, 0.419)));
    vec3 t = normalize(cross(vec3(0.0, 1.0, 0.0), n));
    Frame f = Frame(n, t, cross(n, t));
    vec3 l = normalize(vec3(0.1) + fract(place.xyx * vec3(0.1031, 0.3113, 0.5179)));
    vec3 v = normalize(vec3(0.1) + fract(place.yxy * vec3(0.2371, 0.0973, 0.4517)));
    vec3 c = u_drift;
    for (int i = 0; i < u_count; ++i) {
        c += value(f, l, v);
        // The next round uses every component of both directions: all are computed, even if this model reads few of them.
        vec3 next = l.yzx + u_drift;
        l = v;
        v = next;
    }
    return c + l + v + f.t + f.b;
}
