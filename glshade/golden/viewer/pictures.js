// Pictures: decodes the exact pictures of a case, and turns their values into colours.
//
// A picture is {width, height, names, floats, values}: `values` holds the channels `names` of one pixel after the other, from the
// top left; 8-bit codes with straight alpha, or, where `floats` is true, linear numbers with premultiplied alpha.

const BROKEN = [255, 0, 255]; // the colour of pixels with an infinite or NaN value
const FAINTEST = { codes: 1 / 255, floats: 1e-5 }; // the least difference with a colour of its own [linear]
const SEEN = 0.25; // its place on the ramp, well apart from the first colour, which stands for equal pixels

const bytesOf = (text) => Uint8Array.from(atob(text), (character) => character.charCodeAt(0));

// Returns the bytes that zlib has compressed (RFC 1950).
async function inflated(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Returns a picture of {kind, channels, data} as the page embeds it.
async function decoded(stored) {
  const bytes = bytesOf(stored.data);
  return stored.kind === "png" ? png(bytes, stored.channels) : floats(bytes, stored);
}

// Returns a picture of compressed float32 numbers, whose bytes of equal weight lie together.
async function floats(bytes, { size: [width, height], channels }) {
  const planes = await inflated(bytes);
  const count = width * height * channels.length;
  const mixed = new Uint8Array(4 * count);
  for (let plane = 0; plane < 4; plane++) {
    for (let i = 0, from = plane * count; i < count; i++) mixed[4 * i + plane] = planes[from + i];
  }
  return { width, height, names: channels, floats: true, values: new Float32Array(mixed.buffer) };
}

// Returns a picture of a PNG file with 8 bits a channel, without a palette and not interlaced. A canvas would multiply the
// colours by alpha and lose digits. The numbers of the filters and colour types are those of the specification (W3C, PNG).
async function png(bytes, names) {
  const view = new DataView(bytes.buffer);
  const [width, height] = [view.getUint32(16), view.getUint32(20)];
  const count = { 0: 1, 2: 3, 4: 2, 6: 4 }[bytes[25]];
  const parts = [];
  for (let at = 8; at < bytes.length; ) {
    const length = view.getUint32(at);
    if (view.getUint32(at + 4) === 0x49444154 /* IDAT */) parts.push(bytes.subarray(at + 8, at + 8 + length));
    at += 12 + length;
  }
  const raw = await inflated(await new Blob(parts).arrayBuffer());
  const row = width * count;
  const values = new Uint8Array(row * height);
  for (let y = 0; y < height; y++) unfilter(raw, y * (row + 1), values, y * row, row, count);
  return { width, height, names, floats: false, values };
}

// Restores one row of a PNG file, whose bytes are stored as differences from a prediction by their neighbours.
function unfilter(raw, from, values, to, row, count) {
  const filter = raw[from++];
  const above = to >= row ? to - row : -1;
  for (let i = 0; i < row; i++) {
    const left = i >= count ? values[to + i - count] : 0;
    const up = above >= 0 ? values[above + i] : 0;
    let predicted = 0;
    if (filter === 1) predicted = left;
    else if (filter === 2) predicted = up;
    else if (filter === 3) predicted = (left + up) >> 1;
    else if (filter === 4) predicted = paeth(left, up, above >= 0 && i >= count ? values[above + i - count] : 0);
    values[to + i] = raw[from + i] + predicted;
  }
}

// Returns the neighbour that is nearest to left + up - corner (Paeth 1991).
function paeth(left, up, corner) {
  const [a, b, c] = [Math.abs(up - corner), Math.abs(left - corner), Math.abs(left + up - 2 * corner)];
  return a <= b && a <= c ? left : b <= c ? up : corner;
}

// The sRGB code of linear numbers in 65,536 steps (IEC 61966-2-1).
const CODES = Uint8Array.from({ length: 65536 }, (_, i) => {
  const x = i / 65535;
  return Math.round(255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055));
});

// Returns a canvas that shows a picture. exposure: the factor of linear numbers.
function shown(picture, exposure) {
  const { width, height, names, values } = picture;
  const pixels = new ImageData(width, height);
  const colour = picture.floats ? ofFloats(picture, exposure) : (x) => x;
  const count = names.length;
  const hasAlpha = names.at(-1) === "A" && count > 1;
  const green = count - hasAlpha >= 3 ? 1 : 0;
  const blue = count - hasAlpha >= 3 ? 2 : 0;
  for (let i = 0, from = 0, to = 0; i < width * height; i++, from += count, to += 4) {
    const alpha = hasAlpha ? values[from + count - 1] : 1;
    pixels.data[to] = colour(values[from], alpha);
    pixels.data[to + 1] = colour(values[from + green], alpha);
    pixels.data[to + 2] = colour(values[from + blue], alpha);
    pixels.data[to + 3] = hasAlpha ? (picture.floats ? 255 * alpha : alpha) : 255;
    if (picture.floats && broken(values, from, count)) pixels.data.set([...BROKEN, 255], to);
  }
  return canvasOf(pixels);
}

// Returns the function of a float and its alpha that gives its code. Components of a direction, from -1 to 1, are not light.
function ofFloats({ names }, exposure) {
  if (names[0] === "X") return (x) => 127.5 * (x * exposure + 1);
  return (x, alpha) => CODES[Math.min(65535, Math.max(0, (65535 * exposure * x) / (alpha > 0 ? alpha : 1))) | 0];
}

function broken(values, from, count) {
  for (let i = from; i < from + count; i++) if (!Number.isFinite(values[i])) return true;
  return false;
}

function canvasOf(pixels) {
  const canvas = element("canvas", { width: pixels.width, height: pixels.height });
  canvas.getContext("2d").putImageData(pixels, 0, 0);
  return canvas;
}

// Returns the differences of two pictures of one size: {places, worst, count, broken}. `places` says for each pixel where the
// largest difference of its channels lies on the ramp, from 0 to 1, on a logarithmic scale; 2 is a value that is not finite.
// `worst` is the pixel [column, row] that differs most.
function differences(expected, actual) {
  const { width, height } = expected;
  const count = expected.names.length;
  const units = expected.floats || actual.floats ? FAINTEST.floats : FAINTEST.codes;
  const [first, second] = [expected, actual].map((picture) => (picture.floats ? 1 : 1 / 255));
  const result = { width, height, places: new Float32Array(width * height), worst: null, count: 0 };
  let most = 0;
  for (let i = 0, from = 0; i < width * height; i++, from += count) {
    let error = 0;
    for (let c = from; c < from + count; c++) {
      const [a, b] = [expected.values[c] * first, actual.values[c] * second];
      if (Object.is(a, b)) continue;
      const difference = Math.abs(a - b);
      error = Math.max(error, Number.isFinite(difference) ? difference : Infinity);
    }
    if (!error) continue;
    result.count++;
    result.places[i] = error === Infinity ? 2 : SEEN + (1 - SEEN) * Math.min(1, Math.max(0, 1 - Math.log(error) / Math.log(units)));
    if (error > most) [most, result.worst] = [error, [i % width, Math.floor(i / width)]];
  }
  return result;
}

// Returns a canvas that shows differences on the ramp. Each of its pixels stands for step x step pixels, and shows the largest
// difference among them, so that no pixel is lost.
function heated({ width, height, places }, ramp, step) {
  const pixels = new ImageData(Math.ceil(width / step), Math.ceil(height / step));
  const largest = new Float32Array(pixels.width * pixels.height);
  for (let y = 0, i = 0; y < height; y++) {
    const row = Math.floor(y / step) * pixels.width;
    for (let x = 0; x < width; x++, i++) {
      const to = row + Math.floor(x / step);
      if (places[i] > largest[to]) largest[to] = places[i];
    }
  }
  const table = Array.from({ length: 256 }, (_, i) => onRamp(ramp, i / 255));
  for (let i = 0; i < largest.length; i++) {
    const colour = largest[i] > 1 ? BROKEN : table[Math.round(255 * largest[i])];
    pixels.data.set(colour, 4 * i);
    pixels.data[4 * i + 3] = 255;
  }
  return canvasOf(pixels);
}

function onRamp(ramp, place) {
  const at = Math.min(place * (ramp.length - 1), ramp.length - 1 - 1e-9);
  const lower = Math.floor(at);
  return ramp[lower].map((x, i) => Math.round(x + (ramp[lower + 1][i] - x) * (at - lower)));
}

// Returns the values of one pixel; null outside the picture.
function valuesAt(picture, [x, y]) {
  if (!picture || x < 0 || y < 0 || x >= picture.width || y >= picture.height) return null;
  const from = (y * picture.width + x) * picture.names.length;
  return [...picture.values.subarray(from, from + picture.names.length)];
}

// Loads the pictures of a case and keeps those of the last few cases.
class Store {
  constructor() {
    this.kept = new Map();
    this.waiting = new Map();
    // The files pixels.js call this function.
    globalThis.glshadePixels = (address, exact) => this.waiting.get(address)?.(exact);
  }

  // Returns what the page embeds for a case: {thumbnails, exact, beside, layer, reduced}.
  embedded(index) {
    const stored = find(`pictures-${index}`);
    return stored ? JSON.parse(stored.textContent) : {};
  }

  // Returns the exact pictures of a case: role -> picture; an empty object where there are none, or their file is not there.
  get(index) {
    if (!this.kept.has(index)) {
      this.kept.set(index, this.load(index));
      const [oldest] = this.kept.keys();
      if (this.kept.size > 4) this.kept.delete(oldest);
    }
    return this.kept.get(index);
  }

  async load(index) {
    const { exact, beside } = this.embedded(index);
    const stored = exact ?? (beside ? await this.script(beside) : {});
    const pictures = await Promise.all(Object.values(stored).map(decoded));
    return Object.fromEntries(Object.keys(stored).map((role, i) => [role, pictures[i]]));
  }

  // Runs a file pixels.js beside the page, and returns the pictures that it holds.
  script(address) {
    return new Promise((resolve) => {
      const script = element("script", { src: address });
      const done = (exact) => {
        this.waiting.delete(address);
        script.remove();
        resolve(exact);
      };
      this.waiting.set(address, done);
      script.onload = script.onerror = () => done({});
      document.head.append(script);
    });
  }
}
