#include "lib/colour.glsl"

// sRGB-encoded, premultiplied before the encoding.
vec4 encode(vec3 c, float alpha) {
    return vec4(linear_to_srgb(c * alpha), alpha);
}
