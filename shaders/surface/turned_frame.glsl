#include "surface/frame.glsl"

// The shading frame rotated about its normal. d is (cos, sin) of the angle from the tangent toward the bitangent.
Frame turned_frame(Frame f, vec2 d) {
    return Frame(f.n, d.x * f.t + d.y * f.b, d.x * f.b - d.y * f.t);
}
