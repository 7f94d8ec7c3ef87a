// The share of light that passes at normal incidence, 1 - f0_conductor, computed without the subtraction.
vec3 t0_conductor(vec3 eta, vec3 k) {
    return 4.0 * eta / ((eta + 1.0) * (eta + 1.0) + k * k);
}
