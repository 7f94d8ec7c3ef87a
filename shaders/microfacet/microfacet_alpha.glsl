// A mirror shows no point light, so a lobe has a least width. Textures with black texels stay finite by it.
const float LEAST_ROUGHNESS = 0.01;

// The width alpha of a microfacet distribution (Burley 2012, section 5.4): steps of equal size look equal.
float microfacet_alpha(float roughness) {
    roughness = max(roughness, LEAST_ROUGHNESS);
    return roughness * roughness;
}
