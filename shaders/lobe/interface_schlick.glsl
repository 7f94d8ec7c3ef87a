// The smooth interface of a dielectric by Schlick 1994, eq. 15, which replaces lobe/interface_exact.glsl. interface_f0 returns
// the reflectance at normal incidence, f0 = ((eta - 1)/(eta + 1))^2.
float interface_f0(float eta) {
    float z = (eta - 1.0) / (eta + 1.0);
    return z * z;
}

// The share of light that a facet reflects.
float interface_reflects(float LoH, float eta) {
    float f0 = interface_f0(eta);
    float x = 1.0 - LoH;
    float x2 = x * x;
    return f0 + (1.0 - f0) * (x2 * x2 * x);
}

// The share of light that passes. 1 - (1 - c)^5 is computed in factored form, so that small cosines keep their digits.
float interface_passes(float c, float eta) {
    float a = 1.0 - c;
    return (1.0 - interface_f0(eta)) * c * (1.0 + a * (1.0 + a * (1.0 + a * (1.0 + a))));
}

// The share of diffuse light from outside that is reflected: the integral of 2 c F(c) over [0, 1].
float interface_diffuse(float eta) {
    float f0 = interface_f0(eta);
    return f0 + (1.0 - f0) * (1.0 / 21.0);
}
