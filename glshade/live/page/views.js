// The choice of what a pane shows.

import { element, find } from "./dom.js";

const PICTURES = {
  picture: "Picture",
  flat: "Flat: once a face",
  gouraud: "Gouraud: once a vertex",
  phong: "Phong: once a pixel",
};
const COMPARED = {
  last_good: "Last good revision",
  previous: "Previous revision",
  reference: "Reference, float64",
  file: "A file …",
};
const CHECKS = { heat: "Heat map of the error", nan: "NaN and infinity" };
const RATES = ["flat", "gouraud", "phong"];
const SOURCES = ["last_good", "previous", "reference", "heat"];

// variable: the variable of an object's program that is shown, as the trace of a pixel gives it
export const title = (choice, file, variable) =>
  choice === "variable" ? `${variable.name}, ${variable.short}:${variable.line}` : choice === "file" ? file || "A file" : { ...PICTURES, ...COMPARED, ...CHECKS }[choice]?.replace(" …", "") ?? choice.replace("layer:", "Layer ");

// The keys of a view that differ from those of the plain picture.
export function viewOf(choice, file, variable) {
  const plain = { size: null, shading: null, layer: null, paint: null, source: "picture" };
  if (RATES.includes(choice)) return { ...plain, shading: choice };
  if (SOURCES.includes(choice)) return { ...plain, source: choice };
  if (choice === "variable") {
    const { object, file: path, line, name, number } = variable;
    return { ...plain, source: choice, variable: { object, place: `${path}:${line}`, name, number } };
  }
  if (choice === "file") return { ...plain, source: `file:${file}` };
  if (choice === "nan") return { ...plain, paint: "nan" };
  if (choice.startsWith("layer:")) return { ...plain, layer: choice.slice("layer:".length) };
  return plain;
}

// Whether the verifier can judge such a view: a picture that the GPU drew.
export const isJudged = (choice) => choice in PICTURES;

// Whether such a view is computed in float64, which takes seconds.
export const isSlow = (choice) => ["reference", "heat", "variable"].includes(choice);

// Two selects with a field for a file each; `changed()` is called after each change.
export class Views {
  constructor(changed) {
    this.changed = changed;
    this.selects = [find("view-0"), find("view-1")];
    this.files = [find("file-0"), find("file-1")];
    this.layers = null;
    this.variable = null;
    this.fill([]);
    for (const control of [...this.selects, ...this.files]) control.addEventListener("change", () => this.update());
    find("layout").addEventListener("change", () => this.update());
    find("toolbar").addEventListener("submit", (event) => event.preventDefault());
  }

  fill(layers) {
    if (JSON.stringify(layers) === JSON.stringify(this.layers)) return;
    this.layers = layers;
    this.selects.forEach((select, index) => {
      const chosen = select.value;
      const nothing = index ? [element("option", { value: "" }, "Nothing")] : [];
      select.replaceChildren(
        ...nothing,
        group("Shading", PICTURES),
        group("Compare", COMPARED),
        group("Check", CHECKS),
        ...(index && this.variable ? [this.group()] : []),
        ...(layers.length ? [group("Layers", Object.fromEntries(layers.map((name) => [`layer:${name}`, name])))] : []),
      );
      select.value = [...select.options].some(({ value }) => value === chosen) ? chosen : index ? "" : "picture";
    });
  }

  // Shows a variable beside the picture. `changed` is not called, because the probe stays.
  show(variable) {
    this.variable = variable;
    const select = this.selects[1];
    select.querySelector("[value=variable]")?.parentElement.remove();
    select.append(this.group());
    select.value = "variable";
    this.arrange();
  }

  group() {
    return group("Variable", { variable: title("variable", "", this.variable) });
  }

  update() {
    this.arrange();
    this.changed();
  }

  arrange() {
    this.selects.forEach((select, index) => (this.files[index].parentElement.hidden = select.value !== "file"));
    find("layout").hidden = !this.selects[1].value;
  }

  get layout() {
    return this.selects[1].value ? find("layout").querySelector(":checked").value : "single";
  }

  // [{choice, title, view}] of the panes that are shown. A file without a name is not asked for.
  get panes() {
    return this.selects
      .map((select, index) => ({ choice: select.value, file: this.files[index].value.trim() }))
      .filter(({ choice }) => choice)
      .map(({ choice, file }) => (choice === "file" && !file ? { choice: "picture", file } : { choice, file }))
      .map(({ choice, file }) => ({ choice, title: title(choice, file, this.variable), view: viewOf(choice, file, this.variable) }));
  }
}

const group = (label, choices) =>
  element("optgroup", { label }, ...Object.entries(choices).map(([value, text]) => element("option", { value }, text)));
