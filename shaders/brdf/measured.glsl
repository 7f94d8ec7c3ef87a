#include "math/constants.glsl"
#include "math/right_angles.glsl"
#include "surface/frame.glsl"
#include <arriving>
#include <azimuth>

// The logarithm to base 2 of measured BRDF values, over the half angle theta_h along x, the difference angle theta_d along y
// and the azimuth phi_d of l about h along z (Rusinkiewicz 1998). As in Matusik's tables, x is the square root of theta_h,
// because highlights are narrow. All angles are in units of a right angle.
uniform sampler3D u_reflectance;

// Measured values, which are read from a table. scale multiplies them.
struct Measured {
    vec3 scale;
    vec3 ka;
};

vec3 brdf_cos(Measured m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    float NoV = dot(f.n, v);
    vec3 i = arriving(f, l, NoL);
    vec3 H = i + v;
    vec3 q = i - v;
    float length_H = length(H);
    vec3 h = H / max(length_H, 1e-6);
    // theta_h is computed from |n - h|, the chord of the angle, because n.h loses the digits of a small angle.
    vec3 p = f.n - h;
    float chord2 = min(dot(p, p), 2.0);
    float theta_h = right_angles(sqrt(chord2 * (1.0 - 0.25 * chord2)), 1.0 - 0.5 * chord2);
    // Half the length of i - v is the sine of theta_d, and half the length of i + v is its cosine.
    float theta_d = right_angles(0.5 * length(q), 0.5 * length_H);
    // h and q are perpendicular. These are cosine and sine of phi_d, both times sin(theta_h) |q|.
    float x = -dot(f.n, q);
    float y = dot(cross(f.n, h), q);
    float r = sqrt(x * x + y * y);
    float inverse = r > 1e-15 ? 1.0 / r : 0.0;
    float phi_d = right_angles(abs(y) * inverse, abs(x) * inverse);
    vec3 place = vec3(sqrt(theta_h), theta_d, azimuth(phi_d, x, y));
    vec3 value = exp2(textureLod(u_reflectance, place, 0.0).rgb);
    return NoL > 0.0 && NoV > 0.0 ? m.scale * value * NoL : vec3(0.0);
}

vec3 ambient_reflectance(Measured m) {
    return m.ka;
}
