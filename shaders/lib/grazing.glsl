// 2^-20: some ten roundings of a cosine near 0. Models that divide by a cosine count a smaller one as this.
const float GRAZING = 9.5367431640625e-7;
