// The output encoded with a power of 1/2.2 and then premultiplied, so that the background is blended in encoded values.
vec4 encode(vec3 c, float alpha) {
    return vec4(pow(clamp(c, 0.0, 1.0), vec3(1.0 / 2.2)) * alpha, alpha);
}
