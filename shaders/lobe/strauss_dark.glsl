// The diffuse lobe of Strauss's model is 0 for a material that has only the highlight.
float strauss_diffuse(Strauss m, float NoL) {
    return 0.0;
}
