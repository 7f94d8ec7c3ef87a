#include <across>
#include "lib/grazing.glsl"

// The Gaussian of the half vector's slope (Ward 1992, eq. 5a) by H = l + v, which is not unit (Walter 2005).
struct Gaussian {
    float root;    // exp(-slope^2 / 2): twice a factor, with what is large between, it does not vanish below FLT_MIN too early
    float tan2;    // the square of the tangent of the half vector's angle
    float height;  // H.n
};

Gaussian gaussian(Frame f, vec3 H, float alpha_x, float alpha_y) {
    vec2 squares = across(f, H);
    float height = max(dot(f.n, H), GRAZING);
    float height2 = height * height;
    float slope2 = (squares.x / (alpha_x * alpha_x) + squares.y / (alpha_y * alpha_y)) / height2;
    return Gaussian(exp(-0.5 * slope2), (squares.x + squares.y) / height2, height);
}
