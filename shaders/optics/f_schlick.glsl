// The Fresnel term of Schlick 1994, eq. 15. It is a model of its own, not a form of the exact Fresnel term: for glass the two
// differ by up to 0.036.
vec3 f_schlick(vec3 f0, float LoH) {
    float x = 1.0 - LoH;
    float x2 = x * x;
    return f0 + (1.0 - f0) * (x2 * x2 * x);
}
