#include "math/constants.glsl"
#include "surface/frame.glsl"
#include "lobe/gaussian.glsl"

// The model of Ward 1992, eq. 5a: (kd/pi + ks exp(-slope^2) / (4 pi alpha_x alpha_y sqrt((n.l) (n.v)))) n.l.
// slope is the half vector's slope, scaled as in lobe/gaussian.glsl.
struct Ward {
    vec3 kd;
    vec3 ks;
    float alpha_x;
    float alpha_y;
};

vec3 brdf_cos(Ward m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    float NoV = dot(f.n, v);
    Gaussian g = gaussian(f, l + v, m.alpha_x, m.alpha_y);
    float low = max(NoL, GRAZING) * max(NoV, GRAZING);
    float specular = 0.25 * inversesqrt(low) / (m.alpha_x * m.alpha_y) * g.root * g.root;
    float lit = NoL > 0.0 && NoV > 0.0 ? INV_PI * NoL : 0.0;
    return m.kd * lit + m.ks * (lit * specular);
}

vec3 ambient_reflectance(Ward m) {
    return m.kd;
}
