// In place of any of the other diffuse terms: the material has none.
vec3 diffuse(vec3 kd, vec3 f0, float c, float d) {
    return vec3(0.0);
}

vec3 diffuse(vec3 kd, vec3 eta, vec3 k, float NoL, float NoV) {
    return vec3(0.0);
}
