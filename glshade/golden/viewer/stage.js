// Stage: shows the pictures of one case beside each other, under a swipe, in turn, or as their difference, at one place and zoom.

const ZOOM = 1.25; // one press of a key, and one notch of a wheel, zooms by this factor
const CLOSEST = 64; // the largest zoom [screen pixels a pixel of the picture]
const BLINK = 700; // the time for which each picture is shown in turn [ms]
const PAN = 0.1; // one press of an arrow key moves by this share of the pane
const MODES = ["side", "swipe", "blink", "difference", "expected", "actual", "classes"];
const NAMES = { expected: "Expected", actual: "Actual", difference: "Difference", classes: "Classes" };

// Returns the change of deltaY that counts as one notch of a wheel. With Ctrl it is a pinch on a trackpad, which sends small steps.
const notch = ({ deltaMode, ctrlKey }) => (deltaMode === WheelEvent.DOM_DELTA_LINE ? 3 : ctrlKey ? 25 : 120);

class Stage {
  // ramp: the colours of the difference. handlers: point(pixel or null), mode(mode), zoom(scale), blink(playing).
  constructor(ramp, handlers) {
    Object.assign(this, { ramp, handlers, root: find("stage"), handle: find("swipe") });
    this.panes = [0, 1].map(() => {
      const canvas = element("canvas");
      const caption = element("figcaption");
      const root = element("figure", { class: "pane" }, element("div", { class: "frame" }, canvas), caption);
      return { root, canvas, caption };
    });
    this.root.prepend(...this.panes.map((pane) => pane.root));
    this.panes[0].canvas.parentElement.append(this.handle);
    this.pointers = new Map();
    Object.assign(this, { mode: "side", size: [1, 1], exposure: 1, swipe: 0.5, second: false, playing: false, fitted: true, dragged: null });
    this.clear();
    new ResizeObserver(() => this.resize()).observe(this.root);
    this.listen();
    this.listenToSwipe();
  }

  clear() {
    // exact: role -> picture with values. images: role -> what a canvas can draw. drawn: what was made of the exact pictures.
    Object.assign(this, { exact: {}, images: {}, drawn: new Map(), differences: null, cross: null });
  }

  // Shows a case. exact, images: as above; images stand in for pictures whose values are not there. size: [width, height].
  show(exact, images, size) {
    this.clear();
    Object.assign(this, { exact, images, size, fitted: true });
    const { expected, actual } = exact;
    if (expected && actual && expected.width === actual.width && expected.height === actual.height && expected.names.length === actual.names.length) {
      this.differences = differences(expected, actual);
    }
    this.choose(this.mode);
  }

  has(role) {
    if (role === "difference") return Boolean(this.differences || this.images.difference);
    return Boolean(this.exact[role] || this.images[role]);
  }

  // Returns whether a mode has its pictures.
  offers(mode) {
    return NAMES[mode] ? this.has(mode) : this.has("expected") && this.has("actual");
  }

  choose(mode) {
    this.mode = mode;
    const usable = this.offers(mode) ? mode : ["actual", "expected"].find((role) => this.has(role)) ?? "actual";
    this.used = usable;
    this.root.dataset.mode = usable;
    this.panes[1].root.hidden = usable !== "side";
    this.handle.hidden = usable !== "swipe";
    this.second = false;
    this.play(usable === "blink" && !matchMedia("(prefers-reduced-motion: reduce)").matches);
    this.handlers.mode(usable);
    this.resize();
  }

  // Starts or stops the blinking.
  play(playing) {
    clearInterval(this.timer);
    this.playing = playing;
    if (playing) this.timer = setInterval(() => this.swap(), BLINK);
    this.handlers.blink(playing);
  }

  swap() {
    this.second = !this.second;
    this.draw();
  }

  // The roles that the panes show now.
  roles() {
    if (this.used === "side") return ["expected", "actual"];
    if (this.used === "blink") return [this.second ? "actual" : "expected"];
    return this.used === "swipe" ? ["expected"] : [this.used];
  }

  // Returns what a canvas draws for a role; null where there is nothing.
  image(role) {
    if (role === "difference" && this.differences) {
      const step = Math.max(1, Math.ceil(1 / (this.scale * devicePixelRatio)));
      return this.kept(`difference ${step}`, () => heated(this.differences, this.ramp, step));
    }
    const picture = this.exact[role];
    if (picture) return this.kept(role, () => shown(picture, picture.floats ? this.exposure : 1));
    return this.images[role] ?? null;
  }

  kept(key, make) {
    if (!this.drawn.has(key)) this.drawn.set(key, make());
    return this.drawn.get(key);
  }

  expose(factor) {
    this.exposure = factor;
    for (const role of ["expected", "actual"]) this.drawn.delete(role);
    this.draw();
  }

  // Puts two panes beside or below each other, as the pictures become larger.
  turn() {
    const [width, height] = this.size;
    const room = [this.root.clientWidth, this.root.clientHeight];
    const beside = Math.min(room[0] / 2 / width, room[1] / height);
    const below = Math.min(room[0] / width, room[1] / 2 / height);
    this.root.dataset.direction = this.used === "side" && below > beside ? "column" : "row";
  }

  resize() {
    this.turn();
    for (const { canvas } of this.panes) {
      const box = canvas.parentElement.getBoundingClientRect();
      canvas.width = Math.max(1, Math.round(box.width * devicePixelRatio));
      canvas.height = Math.max(1, Math.round(box.height * devicePixelRatio));
    }
    if (this.fitted) this.fit();
    else this.draw();
  }

  // The width and height of a pane [CSS pixels].
  room() {
    const box = this.panes[0].canvas.parentElement.getBoundingClientRect();
    return [Math.max(1, box.width), Math.max(1, box.height)];
  }

  // The zoom at which the whole picture is seen: a whole number where it is enlarged, so that no pixel is blurred.
  fittingScale() {
    const [width, height] = this.room();
    const scale = Math.min(width / this.size[0], height / this.size[1]);
    return scale > 1 ? Math.min(CLOSEST, Math.floor(scale)) : scale;
  }

  fit() {
    this.scale = this.fittingScale();
    this.centre = this.size.map((length) => length / 2);
    this.fitted = true;
    this.moved();
  }

  // Zooms, and keeps the point [x, y] of the pane at its place; by default its middle.
  zoom(factor, point = this.room().map((length) => length / 2)) {
    const at = this.pointAt(point);
    this.scale = Math.min(CLOSEST, Math.max(this.fittingScale() / 4, this.scale * factor));
    this.centre = at.map((coordinate, i) => coordinate - (point[i] - this.room()[i] / 2) / this.scale);
    this.fitted = false;
    this.moved();
  }

  pan(dx, dy) {
    this.centre = [this.centre[0] - dx / this.scale, this.centre[1] - dy / this.scale];
    this.fitted = false;
    this.moved();
  }

  // Goes to a pixel, close enough to see it.
  goTo([x, y]) {
    this.scale = Math.max(this.scale, 12);
    this.centre = [x + 0.5, y + 0.5];
    this.fitted = false;
    this.point([x, y]);
    this.moved();
  }

  moved() {
    this.centre = this.centre.map((coordinate, i) => Math.min(this.size[i], Math.max(0, coordinate)));
    this.handlers.zoom(this.scale);
    this.draw();
  }

  // Returns the place in the picture of a point of the pane.
  pointAt(point) {
    return point.map((coordinate, i) => this.centre[i] + (coordinate - this.room()[i] / 2) / this.scale);
  }

  // Marks a pixel [column, row] in all panes; null for none.
  point(pixel) {
    const [width, height] = this.size;
    const inside = pixel && pixel[0] >= 0 && pixel[1] >= 0 && pixel[0] < width && pixel[1] < height;
    this.cross = inside ? pixel : null;
    this.handlers.point(this.cross);
    this.draw();
  }

  // Draws at the next frame, once, however often it is called.
  draw() {
    this.asked ??= requestAnimationFrame(() => {
      this.asked = null;
      const roles = this.roles();
      roles.forEach((role, i) => this.paint(this.panes[i], role));
      if (this.used === "swipe") this.paintSwiped();
    });
  }

  paint({ canvas, caption }, role) {
    const context = canvas.getContext("2d");
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, canvas.width, canvas.height);
    this.place(context, canvas, this.image(role), role);
    this.mark(context, canvas);
    const text = this.used === "swipe" ? "Expected | Actual" : NAMES[role];
    if (caption.textContent !== text) caption.textContent = text;
    canvas.dataset.role = role;
  }

  paintSwiped() {
    const { canvas } = this.panes[0];
    const context = canvas.getContext("2d");
    const from = this.swipe * canvas.width;
    context.save();
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(from, 0, canvas.width, canvas.height);
    context.beginPath();
    context.rect(from, 0, canvas.width, canvas.height);
    context.clip();
    this.place(context, canvas, this.image("actual"), "actual");
    context.restore();
    this.mark(context, canvas);
  }

  place(context, canvas, image, role) {
    if (!image) return;
    const scale = this.scale * devicePixelRatio;
    const [x, y] = this.centre.map((coordinate, i) => (i ? canvas.height : canvas.width) / 2 - coordinate * scale);
    // Pictures whose sizes differ share their top left corner.
    const [width, height] = this.exact[role] ? [this.exact[role].width, this.exact[role].height] : this.size;
    context.setTransform(scale, 0, 0, scale, Math.round(x), Math.round(y));
    if (this.exact[role]?.names.at(-1) === "A") this.checker(context, width, height);
    // Thumbnails are JPEG files: their enlarged pixels are not those of the picture.
    context.imageSmoothingEnabled = this.images.small || (scale < 1 && role !== "difference");
    context.imageSmoothingQuality = "high";
    context.drawImage(image, 0, 0, width, height);
  }

  // Fills a picture's place with a checkerboard, which shows through its transparent parts.
  checker(context, width, height) {
    this.board ??= this.squares();
    const pattern = context.createPattern(this.board, "repeat");
    pattern.setTransform(context.getTransform().inverse());
    context.fillStyle = pattern;
    context.fillRect(0, 0, width, height);
  }

  squares() {
    const canvas = element("canvas", { width: 16, height: 16 });
    const context = canvas.getContext("2d");
    context.fillStyle = "#8a8a88";
    context.fillRect(0, 0, 16, 16);
    context.fillStyle = "#a2a2a0";
    context.fillRect(0, 0, 8, 8);
    context.fillRect(8, 8, 8, 8);
    return canvas;
  }

  // Draws a frame round the pixel that is pointed at: white on black shows on every picture.
  mark(context, canvas) {
    if (!this.cross) return;
    const scale = this.scale * devicePixelRatio;
    const size = Math.max(scale, 9 * devicePixelRatio);
    const [x, y] = this.cross.map((at, i) => (i ? canvas.height : canvas.width) / 2 + (at + 0.5 - this.centre[i]) * scale - size / 2);
    context.setTransform(1, 0, 0, 1, 0, 0);
    for (const [colour, thickness] of [["#000", 3], ["#fff", 1]]) {
      context.strokeStyle = colour;
      context.lineWidth = thickness * devicePixelRatio;
      context.strokeRect(Math.round(x) + 0.5, Math.round(y) + 0.5, size, size);
    }
  }

  listen() {
    const { root } = this;
    root.addEventListener("pointerdown", (event) => this.down(event));
    root.addEventListener("pointermove", (event) => this.move(event));
    for (const type of ["pointerup", "pointercancel"]) root.addEventListener(type, (event) => this.up(event));
    root.addEventListener("pointerleave", () => this.pointers.size || this.point(null));
    root.addEventListener("dblclick", () => (this.fitted ? this.goTo(this.cross ?? this.size.map((n) => Math.floor(n / 2))) : this.fit()));
    root.addEventListener(
      "wheel",
      (event) => {
        event.preventDefault();
        const at = this.within(event);
        this.zoom(ZOOM ** (-event.deltaY / notch(event)), at ?? undefined);
      },
      { passive: false },
    );
  }

  paneOf(event) {
    return this.panes.find(({ root }) => root.contains(event.target));
  }

  // Returns the point of a pane at which an event happened; null outside the panes. A drag belongs to the pane where it began.
  within(event) {
    const pane = this.dragged ?? this.paneOf(event);
    if (!pane) return null;
    const box = pane.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  down(event) {
    if (event.target === this.handle || !this.paneOf(event)) return;
    this.dragged ??= this.paneOf(event);
    this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
  }

  up(event) {
    this.pointers.delete(event.pointerId);
    if (!this.pointers.size) this.dragged = null;
  }

  move(event) {
    const before = this.pointers.get(event.pointerId);
    const at = this.within(event);
    if (before && (event.buttons || event.pointerType === "touch")) {
      const spread = this.spread();
      this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
      const share = 1 / this.pointers.size; // two fingers move the picture together
      this.pan((event.clientX - before[0]) * share, (event.clientY - before[1]) * share);
      if (spread && this.spread()) this.zoom(this.spread() / spread, at ?? undefined);
      this.root.setPointerCapture(event.pointerId);
    } else if (before) this.up(event);
    if (at) this.point(this.pointAt(at).map(Math.floor));
  }

  spread() {
    const [a, b] = [...this.pointers.values()];
    return b ? Math.hypot(a[0] - b[0], a[1] - b[1]) : 0;
  }

  // Moves the marked pixel by [dx, dy], and the picture with it where the pixel would leave the pane.
  step([dx, dy]) {
    const [x, y] = this.cross ?? this.centre.map((coordinate) => Math.floor(coordinate));
    const to = [x + dx, y + dy].map((at, i) => Math.min(this.size[i] - 1, Math.max(0, at)));
    const reach = this.room().map((length) => length / 2 / this.scale);
    this.centre = this.centre.map((at, i) => Math.min(to[i] + reach[i], Math.max(to[i] + 1 - reach[i], at)));
    this.point(to);
  }

  listenToSwipe() {
    const { handle } = this;
    const put = (share) => {
      this.swipe = Math.min(1, Math.max(0, share));
      const percent = Math.round(100 * this.swipe);
      handle.style.left = `${100 * this.swipe}%`;
      handle.setAttribute("aria-valuenow", percent);
      handle.setAttribute("aria-valuetext", `${percent} % shows the expected picture`);
      this.draw();
    };
    handle.addEventListener("pointerdown", (event) => {
      event.preventDefault();
      handle.focus();
      handle.setPointerCapture(event.pointerId);
    });
    handle.addEventListener("pointermove", (event) => {
      if (!handle.hasPointerCapture(event.pointerId)) return;
      event.stopPropagation();
      const box = handle.parentElement.getBoundingClientRect();
      put((event.clientX - box.left) / box.width);
    });
    handle.addEventListener("keydown", (event) => {
      const to = { ArrowLeft: this.swipe - 0.02, ArrowRight: this.swipe + 0.02, Home: 0, End: 1 }[event.key];
      if (to === undefined) return;
      event.preventDefault();
      event.stopPropagation();
      put(to);
    });
    put(0.5);
  }
}
