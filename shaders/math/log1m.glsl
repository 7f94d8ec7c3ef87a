// Returns log(1 - s) / s for 0 <= s < 1/4. With z = s / (2 - s), log(1 - s) = -2 atanh(z) and z / s = 1 / (2 - s). The series
// of atanh(z) / z up to z^8 has an error of 3e-9. No digits of a small s are lost, because no two close numbers are subtracted.
float log1m_over(float s) {
    float z = s / (2.0 - s);
    float z2 = z * z;
    return -2.0 / (2.0 - s) * (1.0 + z2 * (1.0 / 3.0 + z2 * (1.0 / 5.0 + z2 * (1.0 / 7.0 + z2 * (1.0 / 9.0)))));
}
