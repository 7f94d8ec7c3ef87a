// The badge, which says whether the picture is right, and the list of the pixels that nobody can explain.

import { announce, element, find } from "./dom.js";

const TEXTS = {
  none: "Not judged",
  judging: "Judging …",
  verified: "Verified",
  failed: "Not verified",
  inconclusive: "Inconclusive",
};

const OWN_TEXT = "Verified against its own text";

export class Verdict {
  // handlers: mark(pixels) shows pixels on the picture, probe(x, y) asks for the values of one
  constructor(handlers) {
    this.handlers = handlers;
    this.badge = find("badge");
    this.panel = find("verdict");
    this.badge.addEventListener("click", () => this.toggle(this.panel.hidden));
    this.panel.addEventListener("keydown", (event) => {
      if (event.key !== "Escape") return;
      this.toggle(false);
      this.badge.focus();
    });
    this.show({ state: "none" });
  }

  // derived: whether the picture was compared with its own GLSL, because a model has no reference
  show({ state, text = "", unexplained = 0, pixels = [], derived = false }) {
    const pixelsText = unexplained === 1 ? "1 pixel unexplained" : `${unexplained} pixels unexplained`;
    this.badge.textContent = unexplained ? pixelsText : derived && state === "verified" ? OWN_TEXT : TEXTS[state];
    this.badge.dataset.state = state;
    this.badge.title = text;
    this.pixels = pixels;
    this.panel.replaceChildren(element("p", {}, text || explanation(state)), this.list());
    if (state === "none" || state === "judging") this.handlers.mark([]);
    else {
      announce(this.badge.textContent);
      this.toggle(!this.panel.hidden);
    }
  }

  list() {
    const button = ([x, y]) =>
      element("li", {}, element("button", { class: "plain figures", type: "button", onclick: () => this.handlers.probe(x, y) }, `${x}, ${y}`));
    return element("ul", { class: "pixels", "aria-label": "Unexplained pixels: column, row" }, ...this.pixels.map(button));
  }

  toggle(open) {
    this.panel.hidden = !open;
    this.badge.setAttribute("aria-expanded", open);
    this.handlers.mark(open ? this.pixels : []);
  }
}

const explanation = (state) =>
  state === "judging"
    ? "The float64 reference is computed for this very view, and each pixel is compared with it."
    : "The picture is judged once it has stood still for half a second.";
