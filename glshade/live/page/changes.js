// The bar below the values: how many were changed, undo, redo, "copy as --set" and "write back".

import { announce, element, find } from "./dom.js";

export class Changes {
  // handlers: options() returns every change as options of glshade render, write() writes them into the scene file
  constructor(values, handlers) {
    this.values = values;
    this.handlers = handlers;
    this.root = find("changes");
    this.count = element("p", { class: "count" });
    this.undo = this.button("Undo", "Undo (Ctrl+Z)", () => values.undo());
    this.redo = this.button("Redo", "Redo (Ctrl+Shift+Z)", () => values.redo());
    this.copy = this.button("Copy as --set", "Copies options for glshade render", () => this.copyOptions());
    this.write = this.button("Write back", "Writes the values into the scene file", () => handlers.write());
    this.text = element("textarea", { class: "figures", readonly: true, rows: 3, hidden: true, "aria-label": "Options for glshade render" });
    this.answer = element("p", { class: "answer", role: "status" });
    const buttons = element("div", { class: "buttons" }, this.undo, this.redo, this.copy, this.write);
    this.root.append(this.count, buttons, this.text, this.answer);
    document.addEventListener("keydown", (event) => this.key(event));
    this.update();
  }

  button(label, title, onclick) {
    return element("button", { type: "button", title, onclick }, label);
  }

  key(event) {
    const typing = event.target.matches("input[type=text], input[type=number], textarea");
    if (typing || event.key.toLowerCase() !== "z" || !(event.ctrlKey || event.metaKey)) return;
    event.preventDefault();
    if (event.shiftKey) this.values.redo();
    else this.values.undo();
  }

  update() {
    const changed = Object.keys(this.values.set).length;
    this.count.textContent = changed === 0 ? "As in the file" : changed === 1 ? "1 value changed" : `${changed} values changed`;
    this.undo.disabled = !this.values.past.length;
    this.redo.disabled = !this.values.future.length;
    this.copy.disabled = !this.handlers.options();
    this.write.disabled = changed === 0;
    this.text.hidden = true;
    this.root.classList.toggle("idle", this.undo.disabled && this.redo.disabled && this.copy.disabled);
    this.say("");
  }

  say(text, ok = true) {
    this.answer.textContent = text;
    this.answer.classList.toggle("bad", !ok);
  }

  async copyOptions() {
    this.text.value = this.handlers.options();
    try {
      await navigator.clipboard.writeText(this.text.value);
      this.say("Copied.");
      announce("Copied.");
    } catch {
      // A browser has no clipboard for a page that came over plain HTTP from another machine.
      this.text.hidden = false;
      this.text.select();
      this.say("Copy the selected text.");
    }
  }
}
