#include "output/encoding.glsl"

// The output premultiplied in linear light and then sRGB-encoded.
vec4 encode(vec3 c, float alpha) {
    return vec4(linear_to_srgb(c * alpha), alpha);
}
