// One factor of Smith's separable shadowing for GGX of width alpha > 0, divided by 2 c for the cosine c:
// G1 / (2 c) = 1 / (c + sqrt(alpha^2 sin^2 + c^2)) (Walter et al. 2007, eq. 34).
float smith_separate(float c, float alpha) {
    return 1.0 / (c + sqrt(alpha * alpha * ((1.0 - c) * (1.0 + c)) + c * c));
}
