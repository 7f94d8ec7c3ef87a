// Of l and v along each axis of the frame: their product, the squares of their sum and difference, the sum of their squares.
struct Axes {
    vec3 products;
    vec3 sums;
    vec3 differences;
    vec3 squares;
};
