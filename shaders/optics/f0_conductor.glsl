// The Fresnel reflectance of a conductor of index eta + i k at normal incidence.
vec3 f0_conductor(vec3 eta, vec3 k) {
    vec3 k2 = k * k;
    return ((eta - 1.0) * (eta - 1.0) + k2) / ((eta + 1.0) * (eta + 1.0) + k2);
}
