// The values of one pixel: what the GPU drew, what the reference says, and the interval in which a right value lies. Below them,
// the variables of the program that shaded it.

import { announce, element, find } from "./dom.js";

const LOUPE = 15; // the loupe shows this many pixels a side
const CELL = 8; // size of a pixel in the loupe [pixels of the screen]

const MANY = 3; // so many lost digits are marked

const figure = (value) => (typeof value === "number" ? value.toPrecision(6) : String(value ?? "–"));

// canvas: the canvas whose pixels the loupe enlarges; scale: its size divided by that of the full picture
export function showProbe(answer, canvas, scale) {
  const section = find("probe");
  section.hidden = false;
  const { x, y } = answer;
  const where = [answer.object ?? "background", answer.triangle === null || answer.triangle === undefined ? "" : `triangle ${answer.triangle}`];
  section.replaceChildren(
    loupe(canvas, Math.floor(x * scale), Math.floor(y * scale)),
    element(
      "div",
      { class: "readout" },
      element("h2", { id: "probe-title" }, `Pixel ${x}, ${y}`, element("span", { class: "quiet" }, where.filter(Boolean).join(", "))),
      answer.value ? table(answer) : null,
      element("p", {}, [answer.class ?? answer.kind, answer.text].filter(Boolean).join(". ")),
    ),
    element("div", { id: "trace", class: "trace", tabindex: "0", "aria-label": "Variables" }, element("p", { class: "quiet" }, "The variables are computed …")),
  );
  announce(`Pixel ${x}, ${y}: ${(answer.value ?? []).slice(0, 3).map(figure).join(", ")}. ${answer.class ?? answer.kind ?? ""}`);
}

export function hideProbe() {
  find("probe").hidden = true;
}

// Shows the variables of the pixel that is shown.
// handlers: show(step) shows a variable as a picture, open(step) shows its line
export function showTrace({ steps = [], left_out: rest = 0, text }, handlers) {
  const section = find("trace");
  if (!section) return;
  const note = text || (steps.length ? "" : "No program shades the background.");
  const head = ["line", "variable", "float64", "float32", "lost digits"].map((name) => element("th", { scope: "col" }, name));
  section.replaceChildren(
    note ? element("p", { class: "quiet" }, note) : "",
    steps.length
      ? element("table", { class: "figures" }, element("thead", {}, element("tr", {}, ...head)), element("tbody", {}, ...steps.map((step) => row(step, handlers))))
      : "",
    rest ? element("p", { class: "quiet" }, `${rest} further values are not listed.`) : "",
  );
  announce(note || `${steps.length} values of variables`);
}

function row(step, { show, open }) {
  const link = (text, title, onclick) => element("button", { class: "plain", type: "button", title, onclick }, text);
  const again = step.number ? ` (${step.number + 1})` : ""; // a line that runs several times
  return element(
    "tr",
    { class: step.digits > MANY ? "bad" : null },
    element("td", {}, link(`${step.short}:${step.line}`, step.text, () => open(step))),
    element("th", { scope: "row" }, step.picture ? link(step.name + again, "Show as a picture", () => show(step)) : step.name + again),
    element("td", { title: step.float64 }, step.float64),
    element("td", { title: step.float32 }, step.float32),
    element("td", {}, step.digits >= 0.05 ? step.digits.toFixed(1) : ""),
  );
}

function table({ value, reference, low, high }) {
  const rows = ["red", "green", "blue"].map((name, i) => {
    const outside = low && high && !(value[i] >= low[i] && value[i] <= high[i]);
    return element(
      "tr",
      { class: outside ? "bad" : null },
      element("th", { scope: "row" }, name),
      element("td", {}, figure(value[i])),
      element("td", {}, figure(reference?.[i])),
      element("td", {}, low && high ? `${figure(low[i])} … ${figure(high[i])}` : "–"),
    );
  });
  const head = ["", "value", "reference", "interval"].map((text) => element(text ? "th" : "td", text ? { scope: "col" } : {}, text));
  return element("table", { class: "figures" }, element("thead", {}, element("tr", {}, ...head)), element("tbody", {}, ...rows));
}

function loupe(source, x, y) {
  const half = Math.floor(LOUPE / 2);
  const canvas = element("canvas", { class: "loupe", width: LOUPE * CELL, height: LOUPE * CELL, "aria-hidden": "true" });
  const context = canvas.getContext("2d");
  context.imageSmoothingEnabled = false;
  context.drawImage(source, x - half, y - half, LOUPE, LOUPE, 0, 0, LOUPE * CELL, LOUPE * CELL);
  const strokes = [["#000", 3], ["#fff", 1]];
  for (const [colour, thickness] of strokes) {
    context.strokeStyle = colour;
    context.lineWidth = thickness;
    context.strokeRect(half * CELL, half * CELL, CELL, CELL);
  }
  return canvas;
}
