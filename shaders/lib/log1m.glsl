// log(1 - s) / s for 0 <= s < 1/4: with z = s / (2 - s), log(1 - s) = -2 atanh(z), and z / s = 1 / (2 - s).
// The series to z^8 is exact to 3e-9 there; nothing is subtracted, so tiny s keep every digit.
float log1m_over(float s) {
    float z = s / (2.0 - s);
    float z2 = z * z;
    return -2.0 / (2.0 - s) * (1.0 + z2 * (1.0 / 3.0 + z2 * (1.0 / 5.0 + z2 * (1.0 / 7.0 + z2 * (1.0 / 9.0)))));
}
