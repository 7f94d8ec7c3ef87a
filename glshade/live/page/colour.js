// Converts between linear Rec. 709, in which a scene states its colours, and the sRGB encoding of the browser's colour picker.

const encode = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
const decode = (x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);

// Returns "#rrggbb" of three linear values, clamped to [0, 1].
export function hexOf(linear) {
  const byte = (x) => Math.round(255 * encode(Math.max(0, Math.min(1, x))));
  return "#" + linear.map((x) => byte(x).toString(16).padStart(2, "0")).join("");
}

// Returns three linear values of "#rrggbb", with 4 digits: more than the 8 bits of the picker hold.
export function linearOf(hex) {
  return [1, 3, 5].map((at) => Number(decode(parseInt(hex.slice(at, at + 2), 16) / 255).toPrecision(4)));
}
