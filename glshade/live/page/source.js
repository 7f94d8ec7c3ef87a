// The files of an object's program, read-only. Lines that lose more than three digits are underlined, with how many.

import { announce, element, find } from "./dom.js";

export class Source {
  // handlers: files(object) and digits(object) ask the server for the files and for the lines that lose digits
  constructor(handlers) {
    this.handlers = handlers;
    this.root = find("source");
    this.revision = null; // number of the revision that is drawn; null while there is none
    this.objects = [];
    this.object = 0;
    this.files = [];
    this.file = null; // the file that is shown
    this.target = null; // {file, line} to show once the files are there
    this.losses = [];
    this.measured = false;
    this.objectSelect = element("select", { id: "source-object", onchange: () => this.choose(this.objectSelect.selectedIndex) });
    this.fileSelect = element("select", { id: "source-file", onchange: () => this.show(this.fileSelect.value) });
    this.note = element("p", { class: "quiet", role: "status" });
    this.text = element("pre", { class: "listing", tabindex: "0" });
    const field = (label, select) => element("label", { class: "chooser" }, element("span", {}, label), select);
    this.root.append(field("Object", this.objectSelect), field("File", this.fileSelect), this.note, this.text);
  }

  get visible() {
    return !this.root.hidden;
  }

  // Takes the objects of the revision that is drawn. Another revision has other files.
  renew(revision, objects) {
    if (revision === this.revision) return;
    this.revision = revision;
    this.objects = objects;
    this.objectSelect.replaceChildren(...objects.map(({ name }) => element("option", {}, name)));
    this.choose(Math.min(this.object, Math.max(objects.length - 1, 0)));
  }

  // Shows the program of another object; place: optional {file, line} to go to.
  choose(object, place = null) {
    this.target = place;
    this.object = object;
    this.objectSelect.selectedIndex = object;
    this.files = [];
    this.forget();
    this.losses = [];
    if (this.visible) this.ask();
  }

  // Asks for what is missing.
  ask() {
    if (!this.files.length && this.objects.length) this.handlers.files(this.object);
    else this.measure();
  }

  // The values of the scene have changed, so the digits have to be measured again.
  forget() {
    this.measured = false;
  }

  measure() {
    if (!this.visible || this.measured || !this.files.length) return;
    this.note.textContent = "The lost digits are measured …";
    this.handlers.digits(this.object);
  }

  receive({ object, files, text = "" }) {
    if (object !== this.object) return;
    this.files = files;
    this.note.textContent = text;
    const wanted = (this.target ?? {}).file ?? this.file;
    this.show(files.some(({ file }) => file === wanted) ? wanted : files[0]?.file);
    this.measure();
  }

  receiveDigits({ object, lines, text = "" }) {
    if (object !== this.object || this.measured) return;
    this.measured = true;
    this.losses = lines;
    const count = lines.length === 1 ? "1 line loses" : `${lines.length || "No"} ${lines.length ? "lines lose" : "line loses"}`;
    this.note.textContent = text || `${count} more than three digits.`;
    announce(this.note.textContent);
    this.show(this.file);
  }

  show(file) {
    this.file = file ?? null;
    const found = this.files.find((candidate) => candidate.file === file);
    const losing = (path) => this.losses.filter((loss) => loss.file === path).length;
    const label = ({ file: path, name }) => (losing(path) ? `${name} (${losing(path)} marked)` : name);
    this.fileSelect.replaceChildren(...this.files.map((each) => element("option", { value: each.file, selected: each.file === file }, label(each))));
    this.text.hidden = !found;
    if (!found) return;
    const width = String(found.lines.length).length;
    this.text.setAttribute("aria-label", `Text of ${found.name}`);
    this.text.replaceChildren(...found.lines.map((text, index) => this.row(file, index + 1, text, width)));
    this.go();
  }

  row(file, number, text, width) {
    // Generated texts of several programs have the same names, so the text of the line has to be the same, too.
    const loss = this.losses.find((each) => each.file === file && each.line === number && each.text === text.trim());
    const indent = text.length - text.trimStart().length;
    const marked = loss
      ? [text.slice(0, indent), element("span", { class: loss.ill_posed ? "losing posed" : "losing" }, text.slice(indent)), element("span", { class: "lost" }, told(loss))]
      : [text];
    return element(
      "span",
      { class: "code", "data-line": number },
      element("span", { class: "number" }, `${String(number).padStart(width)} `),
      ...marked,
      "\n",
    );
  }

  // Goes to the line that was asked for, and marks it.
  go() {
    if (!this.target || this.target.file !== this.file) return;
    const row = this.text.querySelector(`[data-line="${this.target.line}"]`);
    row?.classList.add("target");
    row?.scrollIntoView({ block: "center" });
  }
}

const told = ({ digits, ill_posed: posed }) => `  loses ${digits.toFixed(1)} digits${posed ? ", as rounding the inputs alone does" : ""}`;
