// The values of one pixel: what the GPU drew, what the reference says, and the interval in which a right value lies.

import { announce, element, find } from "./dom.js";

const LOUPE = 15; // the loupe shows this many pixels a side
const CELL = 8; // size of a pixel in the loupe [pixels of the screen]

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
  );
  announce(`Pixel ${x}, ${y}: ${(answer.value ?? []).slice(0, 3).map(figure).join(", ")}. ${answer.class ?? answer.kind ?? ""}`);
}

export function hideProbe() {
  find("probe").hidden = true;
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
