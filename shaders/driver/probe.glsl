// Each question about the driver's arithmetic is answered by one number. The order is that of PROBES in
// glshade/driver/arithmetic.py. Both stages can ask them. The operands are uniforms, because a compiler evaluates constants
// itself.
uniform float u_one;       // 1
uniform float u_large;     // 1e8
uniform float u_near_one;  // 1 + 2^-12
uniform float u_sum;       // -(1 + 2^-11): u_near_one^2 + u_sum is 2^-24, which is lost where the square is rounded first
uniform float u_small;     // 1e-9
uniform float u_denormal;  // 2^-130
uniform float u_normal;    // 2^-126, the smallest normal number
uniform float u_eighth;    // 1/8
uniform int u_rounds;

float probe(int question) {
    // Does mix() return its second argument at 1? The formula a + t (b - a) gives 0 here.
    if (question == 0) return mix(u_large, u_one, u_one);
    // Is a product and a sum contracted to one fused operation? If so, this is not 0.
    if (question == 1) return u_near_one * u_near_one + u_sum;
    // Does the rounding error of a sum survive the optimiser (Knuth's two-sum)? If so, this is not 0.
    if (question == 2) {
        float s = u_one + u_small;
        float b = s - u_one;
        return (u_one - (s - b)) + (u_small - b);
    }
    // Are denormal operands kept? If so, this is not 0.
    if (question == 3) return u_denormal * 1e20;
    // Are denormal results kept? The bits are compared, because a comparison of floats may flush its operands.
    if (question == 4) return floatBitsToInt(u_normal * u_eighth) != 0 ? 1.0 : 0.0;
    // After how many rounds does a loop end that should run u_rounds times?
    if (question == 5) {
        float count = 0.0;
        for (int i = 0; i < u_rounds; ++i)
            count += u_one;
        return count;
    }
#if __VERSION__ >= 400
    // Does fma() round once? If so, this is not 0.
    if (question == 6) return fma(u_near_one, u_near_one, u_sum);
    // Does `precise` protect the rounding error of a sum? If so, this is not 0.
    if (question == 7) {
        precise float s = u_one + u_small;
        precise float b = s - u_one;
        precise float error = (u_one - (s - b)) + (u_small - b);
        return error;
    }
#endif
    return 0.0;
}
