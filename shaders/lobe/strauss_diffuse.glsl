// The diffuse lobe of Strauss 1990 for reflectance 1, times pi n.l. It decreases with smoothness and with metalness.
float strauss_diffuse(Strauss m, float NoL) {
    float s = m.smoothness;
    return (1.0 - m.metalness * s) * (1.0 - s) * (1.0 + s + s * s) * NoL;
}
