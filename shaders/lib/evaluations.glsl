// A model's value many times over, for its cost. Neither direction stays as it is from round to round, and all of them differ
// from pixel to pixel, so that nothing can be worked out once.
#include "lib/frame.glsl"
#include <model>

uniform int u_count;
// Next to nothing, which no compiler knows: without it the rounds would repeat themselves.
uniform vec3 u_drift;

vec3 evaluations(vec2 place) {
    // All components are positive and the normal is in their midst: both directions stay above the horizon.
    vec3 n = normalize(vec3(0.8) + 0.4 * fract(place.yxx * vec3(0.713, 0.137, 0.419)));
    vec3 t = normalize(cross(vec3(0.0, 1.0, 0.0), n));
    Frame f = Frame(n, t, cross(n, t));
    vec3 l = normalize(vec3(0.1) + fract(place.xyx * vec3(0.1031, 0.3113, 0.5179)));
    vec3 v = normalize(vec3(0.1) + fract(place.yxy * vec3(0.2371, 0.0973, 0.4517)));
    vec3 c = u_drift;
    for (int i = 0; i < u_count; ++i) {
        c += value(f, l, v);
        // Each component is handed on, and is worked out whether the model looks at it or not.
        vec3 next = l.yzx + u_drift;
        l = v;
        v = next;
    }
    return c + l + v + f.t + f.b;
}
