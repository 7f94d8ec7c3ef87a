// Strauss 1990: the diffuse lobe of reflectance 1, times pi n.l: less of it the smoother, and the more of a metal.
float strauss_diffuse(Strauss m, float NoL) {
    float s = m.smoothness;
    return (1.0 - m.metalness * s) * (1.0 - s) * (1.0 + s + s * s) * NoL;
}
