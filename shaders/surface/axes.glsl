// Terms of the components of l and v, one for each axis of the shading frame.
struct Axes {
    vec3 products;     // l v
    vec3 sums;         // (l + v)^2
    vec3 differences;  // (l - v)^2
    vec3 squares;      // l^2 + v^2
};
