// The values that were changed on the page: dotted key -> value. Undo, redo, and texts for the command line.

export class Values {
  // `changed(moving)` is called after each change; `moving` says that a slider is being dragged.
  constructor(changed) {
    this.changed = changed;
    this.set = {};
    this.past = [];
    this.future = [];
    this.dragging = false;
  }

  // Puts a value, and forgets values inside it: another model has other parameters. While a slider is dragged, only the state
  // before the drag is kept for undo.
  put(key, value, moving = false) {
    if (!this.dragging) this.remember();
    this.dragging = moving;
    const kept = Object.entries(this.set).filter(([other]) => !belongs(other, key));
    this.set = { ...Object.fromEntries(kept), [key]: value };
    this.changed(moving);
  }

  // Takes a key, and those inside it, back to the values of the file.
  drop(key) {
    this.remember();
    this.set = Object.fromEntries(Object.entries(this.set).filter(([other]) => other !== key && !belongs(other, key)));
    this.changed(false);
  }

  // Drops the keys that a new revision no longer has, without a step of undo. Returns whether there were any.
  keep(valid) {
    const kept = Object.entries(this.set).filter(([key, value]) => valid(key, value));
    if (kept.length === Object.keys(this.set).length) return false;
    this.set = Object.fromEntries(kept);
    return true;
  }

  undo() {
    this.step(this.past, this.future);
  }

  redo() {
    this.step(this.future, this.past);
  }

  step(from, to) {
    if (!from.length) return;
    to.push(this.set);
    this.set = from.pop();
    this.dragging = false;
    this.changed(false);
  }

  remember() {
    this.past.push(this.set);
    this.future = [];
  }
}

// Whether `key` names a value inside the table or list that `whole` names.
export const belongs = (key, whole) => key.startsWith(`${whole}.`);

// Returns a value as TOML.
export function toml(value) {
  if (Array.isArray(value)) return `[${value.map(toml).join(", ")}]`;
  if (value !== null && typeof value === "object") {
    return `{ ${Object.entries(value).map(([key, item]) => `${key} = ${toml(item)}`).join(", ")} }`;
  }
  return JSON.stringify(value);
}

// Returns a text as one word of a POSIX shell.
const quoted = (text) => (/^[\w.,:=\/+-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`);

// Returns the options with which `glshade render` draws the same picture. camera: name of one of the scene's cameras, or null
export function options(set, camera) {
  const values = Object.entries(set).map(([key, value]) => `--set ${quoted(`${key}=${toml(value)}`)}`);
  return [...values, ...(camera ? [`--camera ${quoted(camera)}`] : [])].join(" ");
}
