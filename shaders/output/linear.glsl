// The output in linear Rec. 709, premultiplied.
vec4 encode(vec3 c, float alpha) {
    return vec4(c * alpha, alpha);
}
