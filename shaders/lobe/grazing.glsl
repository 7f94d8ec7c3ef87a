// The smallest cosine by which a model divides; smaller cosines are replaced by it. 2^-20 is about ten roundings of a cosine
// near 0.
const float GRAZING = 9.5367431640625e-7;
