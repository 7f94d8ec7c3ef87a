// Schlick 1994, eq. 15. A choice of model, not a form of the exact Fresnel: it errs by up to 0.036 for glass.
vec3 f_schlick(vec3 f0, float LoH) {
    float x = 1.0 - LoH;
    float x2 = x * x;
    return f0 + (1.0 - f0) * (x2 * x2 * x);
}
