// The least roughness. A perfect mirror shows no highlight of a point light, and the division by alpha must stay finite where a
// texture is black.
const float LEAST_ROUGHNESS = 0.01;

// The width alpha of a microfacet distribution, roughness^2 (Burley 2012, section 5.4): equal steps of roughness look equal.
float microfacet_alpha(float roughness) {
    roughness = max(roughness, LEAST_ROUGHNESS);
    return roughness * roughness;
}
