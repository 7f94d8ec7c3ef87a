// The stage: one picture or two, side by side or under a swipe, with marks on them, and the gestures that move the camera.

import { brief, element, find } from "./dom.js";

const TURN = Math.PI; // a drag across the picture's height turns by this angle [rad]
const STEP = Math.PI / 36; // one press of an arrow key turns by this angle [rad]
const SHIFT = 0.05; // one press of an arrow key moves by this share of the picture's height
const ZOOM = 1.1; // one press of a key, and one notch of a wheel, zooms by this factor
const STILL = 4; // a pointer that moves less than this clicks and does not drag [pixels]
const RING = 7; // radius of the ring round a marked pixel [pixels]

// Returns the change of deltaY that counts as one notch of a wheel. With Ctrl it is a pinch on a trackpad, which sends small steps.
const notch = ({ deltaMode, ctrlKey }) => (deltaMode === WheelEvent.DOM_DELTA_LINE ? 3 : ctrlKey ? 10 : 100);

class Pane {
  constructor(index) {
    this.index = index;
    this.size = [1, 1];
    this.latest = 0;
    this.marks = [];
    this.cross = null;
    this.canvas = element("canvas", { class: "picture", "data-pane": index, width: 1, height: 1 });
    this.context = this.canvas.getContext("2d", { willReadFrequently: true });
    this.overlay = element("canvas", { class: "overlay", "aria-hidden": "true" });
    this.caption = element("span", { class: "caption" });
    this.note = element("p", { class: "note", hidden: true });
    this.legend = element("div", { class: "legend", hidden: true });
    this.frame = element("div", { class: "frame" }, this.canvas, this.overlay, this.note);
    this.below = element("figcaption", {}, this.caption, this.legend);
    this.root = element("figure", { class: "pane" }, this.frame, this.below);
  }

  // Says whether the picture that is shown is an old one, because the one that was asked for takes seconds.
  wait(waiting) {
    this.root.classList.toggle("waiting", waiting);
  }

  // Shows a frame. Frames are decoded in parallel, so one that was overtaken by a newer one is dropped.
  async show(header, blob) {
    const order = ++this.latest;
    this.wait(false);
    if (!header.width) {
      this.fail(header.text ?? "There is no such picture.");
      return true;
    }
    const bitmap = await createImageBitmap(blob, { colorSpaceConversion: "none", premultiplyAlpha: "none" });
    if (order !== this.latest) return false;
    if (this.canvas.width !== bitmap.width || this.canvas.height !== bitmap.height) {
      this.canvas.width = bitmap.width;
      this.canvas.height = bitmap.height;
    }
    this.context.globalCompositeOperation = "copy"; // the alpha of the frame replaces that of the last one
    this.context.drawImage(bitmap, 0, 0);
    bitmap.close();
    this.note.hidden = true;
    Object.assign(this.canvas.dataset, { number: header.number, revision: header.revision, still: header.still });
    this.scale(header.scale);
    return true;
  }

  fail(text) {
    this.context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    this.note.textContent = text;
    this.note.hidden = false;
    this.legend.hidden = true;
  }

  // Shows the scale of a heat map: {low, high, text, colours from low to high}.
  scale(scale) {
    this.legend.hidden = !scale;
    if (!scale) return;
    const bar = element("span", { class: "bar" });
    bar.style.backgroundImage = `linear-gradient(to right, ${scale.colours.join(", ")})`;
    const end = (value) => element("span", { class: "figures" }, brief(value, 3));
    this.legend.replaceChildren(end(scale.low), bar, end(scale.high), element("span", { class: "meaning", title: scale.text }, scale.text));
  }

  // Adapts to a new size of the picture on the screen. The overlay has the screen's own resolution, so that its lines are sharp.
  place(width, height) {
    this.canvas.classList.toggle("enlarged", width > this.size[0]);
    this.overlay.width = Math.round(width * devicePixelRatio);
    this.overlay.height = Math.round(height * devicePixelRatio);
    this.mark();
  }

  // Draws a ring round each marked pixel, and the cross of the probe.
  mark() {
    const context = this.overlay.getContext("2d");
    const [width, height] = [this.overlay.width, this.overlay.height];
    const place = ([x, y]) => [((x + 0.5) / this.size[0]) * width, ((y + 0.5) / this.size[1]) * height];
    context.clearRect(0, 0, width, height);
    const strokes = [["#000", 3], ["#fff", 1]]; // white on black shows on every picture
    for (const [colour, thickness] of strokes) {
      context.strokeStyle = colour;
      context.lineWidth = thickness * devicePixelRatio;
      context.beginPath();
      for (const pixel of this.marks) {
        const [x, y] = place(pixel);
        context.moveTo(x + RING * devicePixelRatio, y);
        context.arc(x, y, RING * devicePixelRatio, 0, 2 * Math.PI);
      }
      if (this.cross) {
        const [x, y] = place(this.cross);
        for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
          context.moveTo(x + 4 * dx * devicePixelRatio, y + 4 * dy * devicePixelRatio);
          context.lineTo(x + 12 * dx * devicePixelRatio, y + 12 * dy * devicePixelRatio);
        }
      }
      context.stroke();
    }
  }

  // Returns the pixel (column, row) of the full-size picture under a point of the window; null outside.
  pixel(x, y) {
    const box = this.canvas.getBoundingClientRect();
    const column = Math.floor(((x - box.left) / box.width) * this.size[0]);
    const row = Math.floor(((y - box.top) / box.height) * this.size[1]);
    const inside = column >= 0 && row >= 0 && column < this.size[0] && row < this.size[1];
    return inside ? [column, row] : null;
  }
}

export class Stage {
  // handlers: orbit(yaw, pitch), pan(dx, dy), zoom(factor), reset(), click(pane, x, y), cross(x, y), clear()
  constructor(handlers) {
    this.handlers = handlers;
    this.root = find("stage");
    this.panes = [new Pane(0), new Pane(1)];
    this.pointers = new Map();
    this.tool = "pick";
    this.root.prepend(...this.panes.map((pane) => pane.root));
    this.panes[0].frame.append(find("swipe"));
    this.arrange("single");
    const observer = new ResizeObserver(() => this.fit());
    for (const observed of [this.root, this.panes[0].below]) observer.observe(observed);
    this.listen();
    this.listenToSwipe();
  }

  // layout: "single", "side" or "swipe".
  arrange(layout) {
    this.root.dataset.layout = layout;
    this.panes[1].root.hidden = layout === "single";
    find("swipe").hidden = layout !== "swipe";
    this.fit();
  }

  resize(width, height) {
    if (this.panes[0].size[0] === width && this.panes[0].size[1] === height) return;
    for (const pane of this.panes) pane.size = [width, height];
    this.fit();
  }

  // Fits the pictures into the stage: at a whole multiple of their size, so that no pixel is blurred, or else smaller.
  fit() {
    const style = getComputedStyle(this.root);
    const pixels = (name) => parseFloat(style[name]) || 0;
    const gap = pixels("columnGap");
    const share = Number(style.getPropertyValue("--share")); // of the window, on a narrow screen; else 0
    const [width, height] = this.panes[0].size;
    const room = [
      this.root.clientWidth - pixels("paddingLeft") - pixels("paddingRight"),
      (share * innerHeight || this.root.clientHeight) - pixels("paddingTop") - pixels("paddingBottom") - this.captionHeight(),
    ];
    const scaleIn = (w, h) => Math.max(0, Math.min(w / width, h / height));
    let factor = scaleIn(...room);
    if (this.root.dataset.layout === "side") {
      const beside = scaleIn((room[0] - gap) / 2, room[1]);
      const below = scaleIn(room[0], (room[1] - gap - this.captionHeight()) / 2);
      this.root.dataset.direction = beside >= below ? "row" : "column";
      factor = Math.max(beside, below);
    }
    if (factor > 1) factor = Math.floor(factor);
    const [shownWidth, shownHeight] = [Math.round(width * factor), Math.round(height * factor)];
    this.root.style.setProperty("--width", `${shownWidth}px`);
    this.root.style.setProperty("--height", `${shownHeight}px`);
    for (const pane of this.panes) pane.place(shownWidth, shownHeight);
  }

  captionHeight() {
    return this.panes[0].below.offsetHeight;
  }

  show(pane, header, blob) {
    return this.panes[pane].show(header, blob);
  }

  mark(pixels) {
    for (const pane of this.panes) {
      pane.marks = pixels;
      pane.mark();
    }
  }

  cross(pixel) {
    for (const pane of this.panes) {
      pane.cross = pixel;
      pane.mark();
    }
  }

  listen() {
    this.root.addEventListener("pointerdown", (event) => this.down(event));
    this.root.addEventListener("pointermove", (event) => this.move(event));
    this.root.addEventListener("pointerup", (event) => this.up(event));
    this.root.addEventListener("pointercancel", (event) => this.pointers.delete(event.pointerId));
    this.root.addEventListener("contextmenu", (event) => event.preventDefault());
    this.root.addEventListener("keydown", (event) => this.key(event));
    this.root.addEventListener(
      "wheel",
      (event) => {
        event.preventDefault();
        this.handlers.zoom(ZOOM ** (event.deltaY / notch(event)));
      },
      { passive: false },
    );
  }

  down(event) {
    const pane = this.panes.find(({ root }) => root.contains(event.target));
    if (!pane) return;
    if (event.button === 1) event.preventDefault(); // the middle button would scroll the page
    this.root.setPointerCapture(event.pointerId);
    const pans = event.button !== 0 || event.shiftKey;
    this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY, startX: event.clientX, startY: event.clientY, pane, pans });
  }

  move(event) {
    const pointer = this.pointers.get(event.pointerId);
    if (!pointer) return;
    const height = pointer.pane.canvas.clientHeight || 1;
    const [before, middle] = [this.spread(), this.middle()];
    const dx = (event.clientX - pointer.x) / height;
    const dy = (event.clientY - pointer.y) / height;
    pointer.dragged ||= Math.hypot(event.clientX - pointer.startX, event.clientY - pointer.startY) >= STILL;
    if (!pointer.dragged) return;
    [pointer.x, pointer.y] = [event.clientX, event.clientY];
    if (this.pointers.size === 2) {
      const [x, y] = this.middle();
      this.handlers.pan((x - middle[0]) / height, (y - middle[1]) / height);
      if (before > 0) this.handlers.zoom(before / Math.max(1, this.spread()));
    } else if (pointer.pans) this.handlers.pan(dx, dy);
    else this.handlers.orbit(-dx * TURN, dy * TURN);
  }

  up(event) {
    const pointer = this.pointers.get(event.pointerId);
    this.pointers.delete(event.pointerId);
    if (!pointer || pointer.dragged) return;
    const pixel = pointer.pane.pixel(event.clientX, event.clientY);
    if (pixel) this.handlers.click(pointer.pane.index, ...pixel);
  }

  middle() {
    const all = [...this.pointers.values()];
    return [all.reduce((sum, { x }) => sum + x, 0) / all.length, all.reduce((sum, { y }) => sum + y, 0) / all.length];
  }

  spread() {
    const [a, b] = [...this.pointers.values()];
    return b ? Math.hypot(a.x - b.x, a.y - b.y) : 0;
  }

  key(event) {
    if (event.target !== this.root || event.ctrlKey || event.metaKey || event.altKey) return;
    const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const arrow = arrows[event.key];
    if (arrow && this.tool === "probe") this.moveCross(arrow, event.shiftKey ? 10 : 1);
    else if (arrow && event.shiftKey) this.handlers.pan(-arrow[0] * SHIFT, -arrow[1] * SHIFT);
    else if (arrow) this.handlers.orbit(arrow[0] * STEP, -arrow[1] * STEP);
    else if (event.key === "+" || event.key === "=") this.handlers.zoom(1 / ZOOM);
    else if (event.key === "-") this.handlers.zoom(ZOOM);
    else if (event.key === "0" || event.key === "Home") this.handlers.reset();
    else if (event.key === "Enter" || event.key === " ") this.handlers.click(0, ...this.crossOrMiddle());
    else if (event.key === "Escape") this.handlers.clear();
    else return;
    event.preventDefault();
  }

  crossOrMiddle() {
    const [width, height] = this.panes[0].size;
    return (this.tool === "probe" && this.panes[0].cross) || [Math.floor(width / 2), Math.floor(height / 2)];
  }

  moveCross([dx, dy], step) {
    const [x, y] = this.crossOrMiddle();
    const [width, height] = this.panes[0].size;
    const within = (value, size) => Math.max(0, Math.min(size - 1, value));
    this.handlers.cross(within(x + dx * step, width), within(y + dy * step, height));
  }

  listenToSwipe() {
    const handle = find("swipe");
    const put = (share) => {
      const percent = Math.round(Math.max(0, Math.min(100, share)));
      this.root.style.setProperty("--swipe", `${percent}%`);
      handle.setAttribute("aria-valuenow", percent);
      handle.setAttribute("aria-valuetext", `${percent} % shows the first picture`);
    };
    const now = () => Number(handle.getAttribute("aria-valuenow"));
    handle.addEventListener("pointerdown", (event) => {
      event.preventDefault();
      event.stopPropagation(); // the stage would turn the camera
      handle.focus();
      handle.setPointerCapture(event.pointerId);
    });
    handle.addEventListener("pointermove", (event) => {
      if (!handle.hasPointerCapture(event.pointerId)) return;
      const box = this.panes[0].canvas.getBoundingClientRect();
      put((100 * (event.clientX - box.left)) / box.width);
    });
    handle.addEventListener("keydown", (event) => {
      const to = { ArrowLeft: now() - 2, ArrowRight: now() + 2, Home: 0, End: 100 }[event.key];
      if (to === undefined) return;
      event.preventDefault();
      put(to);
    });
    put(50);
  }
}
