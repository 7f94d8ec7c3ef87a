// G/(4 n.v) with the shadowing of V-shaped grooves, G = min(1, 2 (n.h)(n.v)/(v.h), 2 (n.h)(n.l)/(v.h))
// (Torrance and Sparrow 1967; Cook and Torrance 1982), where v.h = |l + v|/2. It is finite at the horizon.
float visible(float NoL, float NoV, float H2, float NoH, float alpha) {
    float groove = 4.0 * NoH * inversesqrt(max(H2, 1e-12));
    return 0.25 * min(1.0 / NoV, groove * min(NoL / NoV, 1.0));
}
