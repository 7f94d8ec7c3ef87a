#include <across>
#include "lobe/grazing.glsl"

// The Gaussian of the half vector's slope (Ward 1992, eq. 5a), computed from H = l + v without normalising it (Walter 2005).
// The components of the slope are divided by alpha_x and alpha_y.
// `root` is the square root of the Gaussian: a caller multiplies by it twice, with large factors in between, so that the
// product is not flushed to 0 too early.
struct Gaussian {
    float root;    // exp(-slope^2 / 2)
    float tan2;    // the square of the tangent of the half vector's angle to n
    float height;  // H.n
};

Gaussian gaussian(Frame f, vec3 H, float alpha_x, float alpha_y) {
    vec2 squares = across(f, H);
    float height = max(dot(f.n, H), GRAZING);
    float height2 = height * height;
    float slope2 = (squares.x / (alpha_x * alpha_x) + squares.y / (alpha_y * alpha_y)) / height2;
    return Gaussian(exp(-0.5 * slope2), (squares.x + squares.y) / height2, height);
}
