// The diffuse term 0, for a material without a diffuse base. It has the signatures of all other diffuse terms.
vec3 diffuse(vec3 kd, vec3 f0, float c, float d) {
    return vec3(0.0);
}

vec3 diffuse(vec3 kd, vec3 eta, vec3 k, float NoL, float NoV) {
    return vec3(0.0);
}
