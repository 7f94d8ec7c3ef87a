// The values of the scene: a group for each material, light and so on, a row for each parameter.

import { hexOf, linearOf } from "./colour.js";
import { element, find } from "./dom.js";

const LOGARITHMIC = 100; // a slider whose usual range spans this factor is logarithmic
const NOTCHES = 1000; // positions of a logarithmic slider
const FEW = 2; // a section with more groups than this starts with all of them closed
const ORDER = ["material", "light", "camera", "quality", "film", "object"];
const HEADINGS = { material: "Materials", light: "Lights", camera: "Camera", quality: "Quality", film: "Film", object: "Objects" };

const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);
const short = (value) => (typeof value === "number" ? Number(value.toPrecision(6)) : value);

export class Controls {
  // values: the Values that the rows read and change
  constructor(values) {
    this.values = values;
    this.root = find("values");
    this.groups = [];
    this.rows = new Map();
    this.open = new Map();
    this.object = null;
  }

  // Shows the controls of a revision. The rows are built anew only if there are others than before.
  show(groups, objects) {
    const outline = (list) => list.map(({ fields, ...group }) => [group, fields.map(({ value, ...field }) => field)]);
    const changed = !same(outline(groups), outline(this.groups)) || !same(objects, this.objects);
    [this.groups, this.objects] = [groups, objects];
    if (changed) this.build();
    this.update();
  }

  // Shows the groups of one object alone, such as one that was picked; null shows all.
  select(key) {
    this.object = this.objects.some((object) => object.key === key) ? key : null;
    this.build();
    this.update();
  }

  build() {
    const focused = document.activeElement?.id;
    this.rows.clear();
    const shown = this.groups.filter((group) => this.isShown(group));
    const sections = ORDER.map((name) => [name, shown.filter(({ section }) => section === name)]).filter(([, list]) => list.length);
    if (this.object) sections.sort(([a], [b]) => (b === "object") - (a === "object"));
    this.root.replaceChildren(
      ...(this.objects.length ? [this.chooser()] : []),
      ...sections.map(([name, list]) => this.section(name, list)),
    );
    if (focused) document.getElementById(focused)?.focus();
  }

  isShown({ section, key }) {
    const object = this.objects.find((candidate) => candidate.key === this.object);
    if (!object) return true;
    if (section === "object") return key === object.key;
    return section !== "material" || key === object.material_key;
  }

  chooser() {
    const options = this.objects.map(({ key, name }) => element("option", { value: key, selected: key === this.object }, name));
    const select = element(
      "select",
      { id: "object", onchange: () => this.select(select.value) },
      element("option", { value: "" }, "The whole scene"),
      ...options,
    );
    return element("label", { class: "chooser" }, element("span", {}, "Object"), select);
  }

  section(name, groups) {
    const opened = groups.length <= FEW && (name !== "object" || Boolean(this.object));
    return element(
      "section",
      { "aria-label": HEADINGS[name] },
      groups.length === 1 && groups[0].title.toLowerCase() === HEADINGS[name].toLowerCase() ? null : element("h2", {}, HEADINGS[name]),
      ...groups.map((group) => this.group(group, opened)),
    );
  }

  group(group, opened) {
    const details = element(
      "details",
      { class: "group", open: this.open.get(group.key) ?? opened },
      element("summary", { onclick: () => this.open.set(group.key, !details.open) }, element("span", { class: "name" }, group.title), element("code", { class: "quiet" }, group.key)),
      ...group.fields.map((field) => this.row(field)),
    );
    return details;
  }

  row(field) {
    const put = (value, moving) => (value === null ? this.values.drop(field.key) : this.values.put(field.key, value, moving));
    const widget = WIDGETS[field.kind](field, `field-${field.key}`, put);
    const back = element("button", {
      class: "plain back",
      type: "button",
      title: "Back to the value of the file",
      "aria-label": `${field.label}: back to the value of the file`,
      onclick: () => this.values.drop(field.key),
    }, "↺");
    const label = element("span", { class: "label", title: field.description ?? field.key }, field.label);
    const root = element("div", { class: "row", "data-key": field.key }, element("div", { class: "head" }, label, back), widget.root);
    this.rows.set(field.key, { field, widget, root, back });
    return root;
  }

  // Shows the current values: the changed ones, else the file's.
  update() {
    for (const field of this.groups.flatMap(({ fields }) => fields)) {
      if (this.rows.has(field.key)) this.rows.get(field.key).field = field;
    }
    for (const { field, widget, root, back } of this.rows.values()) {
      const changed = field.key in this.values.set;
      root.classList.toggle("changed", changed);
      back.hidden = !changed;
      widget.update(changed ? this.values.set[field.key] : field.value);
    }
  }

  // Whether a changed value still fits: its field is there, and takes values of this type.
  fits(key, value) {
    for (const { fields } of this.groups) {
      const field = fields.find((candidate) => candidate.key === key);
      if (field) return field.value === null || Array.isArray(field.value) === Array.isArray(value) || field.kind === "choice";
    }
    return false;
  }
}

// Kind of a field -> function of the field, the id of its first input, and put(value, moving). It returns the root element, and
// update(value), which shows a value.
const WIDGETS = {
  number: (field, id, put) => scalar(field, id, field.label, put),

  colour: (field, id, put) => {
    const names = ["red", "green", "blue"];
    if (!withinOne(field)) return sliders(field, id, names, put);
    const parts = components(field, id, names, put);
    const picker = element("input", {
      type: "color",
      "aria-label": `${field.label}, colour`,
      oninput: () => put(linearOf(picker.value), true),
      onchange: () => put(linearOf(picker.value), false),
    });
    parts.root.prepend(picker);
    return {
      root: parts.root,
      update: (value) => {
        parts.update(value);
        picker.value = hexOf(triple(value));
      },
    };
  },

  vector: (field, id, put) => (field.usual ? sliders : components)(field, id, ["x", "y", "z", "w"], put),

  choice: (field, id, put) => {
    const choices = field.choices.map((choice) => (typeof choice === "object" ? choice : { label: choice, value: choice }));
    if (field.value === null) choices.unshift({ label: "left out", value: null });
    const select = element(
      "select",
      { id, "aria-label": field.label, onchange: () => put(choices[select.selectedIndex].value, false) },
      ...choices.map(({ label }) => element("option", {}, String(label))),
    );
    return {
      root: element("div", { class: "widget" }, select),
      update: (value) => (select.selectedIndex = choices.findIndex((choice) => same(choice.value, value) || choice.label === value)),
    };
  },

  boolean: (field, id, put) => {
    const box = element("input", { id, type: "checkbox", "aria-label": field.label, onchange: () => put(box.checked, false) });
    return { root: element("div", { class: "widget" }, box), update: (value) => (box.checked = Boolean(value)) };
  },
};

const triple = (value) => (Array.isArray(value) ? value.slice(0, 3) : [value ?? 0, value ?? 0, value ?? 0]);

const replaced = (list, index, value) => list.map((old, i) => (i === index ? value : old));

const withinOne = ({ usual, bounds }) => {
  const [low, high] = usual ?? bounds ?? [0, 1];
  return low === 0 && high === 1;
};

// A slider over the usual range. It is logarithmic where the range spans several orders of magnitude.
function slider(field, label, put) {
  const [low, high] = field.usual ?? field.bounds ?? [0, 1];
  const logarithmic = low > 0 && high / low >= LOGARITHMIC;
  const of = (position) => (logarithmic ? low * (high / low) ** (position / NOTCHES) : position);
  const at = (value) => (logarithmic ? NOTCHES * (Math.log(Math.max(low, value) / low) / Math.log(high / low)) : value);
  const value = () => (field.whole ? Math.round(of(Number(input.value))) : Number(of(Number(input.value)).toPrecision(4)));
  const input = element("input", {
    type: "range",
    min: logarithmic ? 0 : low,
    max: logarithmic ? NOTCHES : high,
    step: logarithmic ? 1 : (field.step ?? (high - low) / NOTCHES),
    "aria-label": label,
    oninput: () => put(value(), true),
    onchange: () => put(value(), false),
  });
  return {
    root: input,
    update: (value) => {
      const number = value ?? low;
      input.value = at(number);
      input.setAttribute("aria-valuetext", String(short(number)));
    },
  };
}

// A number in figures, within the bounds; text that is not a number, or not within them, is not taken.
function numeral(field, id, label, put) {
  const [low, high] = field.bounds ?? [null, null];
  const input = element("input", {
    id,
    type: "number",
    min: low,
    max: high,
    step: field.whole ? 1 : "any",
    inputmode: "decimal",
    "aria-label": label,
    onchange: () => input.value !== "" && input.reportValidity() && put(Number(input.value), false),
  });
  return {
    root: input,
    update: (value) => {
      if (document.activeElement !== input || input.validity.valid) input.value = value === null ? "" : short(value);
    },
  };
}

// A slider and its value in figures.
function scalar(field, id, label, put) {
  const parts = [slider(field, label, put), numeral(field, id, label, put)];
  return {
    root: element("div", { class: "widget number" }, ...parts.map(({ root }) => root)),
    update: (value) => parts.forEach((part) => part.update(value)),
  };
}

// Several numbers that change as one value: in figures alone, or each with a slider.
const components = (...facts) => together(numeral, "widget", ...facts);
const sliders = (...facts) => together(scalar, "widget sliders", ...facts);

function together(build, style, field, id, names, put) {
  const length = Array.isArray(field.value) ? field.value.length : 3;
  let current = [];
  const inputs = names.slice(0, length).map((name, index) =>
    build(field, index ? `${id}-${name}` : id, `${field.label}, ${name}`, (value, moving) => put(replaced(current, index, value), moving)),
  );
  return {
    root: element("div", { class: style }, ...inputs.map(({ root }) => root)),
    update: (value) => {
      current = Array.isArray(value) ? value : inputs.map(() => value ?? 0);
      inputs.forEach((input, index) => input.update(current[index]));
    },
  };
}
