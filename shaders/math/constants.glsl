// Constants that many files use.
const float PI = 3.14159265358979324;
const float INV_PI = 0.318309886183790672;
// The smallest normal float32. Fragment stages may flush smaller numbers to 0, so it is the smallest safe lower bound of a
// divisor.
const float FLT_MIN = 1.17549435e-38;
