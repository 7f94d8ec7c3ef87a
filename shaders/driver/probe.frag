#include <version>
// Pixel i of a row computes probe i. The GLSL version is generated: it is 4.00 if the context supports it, because `fma` and
// `precise` need it.
#include "driver/probe.glsl"

out vec4 o_value;

void main() {
    o_value = vec4(probe(int(gl_FragCoord.x)));
}
