#include <version>
// Vertex i answers question i. The version is generated: 4.00 where the context has it, for fma and `precise`.
#include "driver/probe.glsl"

out float v_value;

void main() {
    v_value = probe(gl_VertexID);
    gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
}
