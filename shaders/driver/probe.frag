#include <version>
// Pixel i of a row answers question i. The version is generated: 4.00 where the context has it, for fma and `precise`.
#include "driver/probe.glsl"

out vec4 o_value;

void main() {
    o_value = vec4(probe(int(gl_FragCoord.x)));
}
