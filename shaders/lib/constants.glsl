const float PI = 3.14159265358979324;
const float INV_PI = 0.318309886183790672;
// The smallest normal float: fragment stages flush what is below, so a floor here stays a floor.
const float FLT_MIN = 1.17549435e-38;
