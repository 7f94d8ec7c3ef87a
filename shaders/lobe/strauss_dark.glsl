// In place of the diffuse lobe: the highlight alone.
float strauss_diffuse(Strauss m, float NoL) {
    return 0.0;
}
