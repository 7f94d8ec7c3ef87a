// Cases: the list with its filter, order and groups, the ticks, and the command that approves what is ticked.

const MOST_OPEN = 40; // with more rows than this, groups are closed at first

// Returns a text quoted for a POSIX shell.
const quoted = (text) => (/^[\w@%+=:,./-]+$/.test(text) ? text : `'${text.replaceAll("'", `'"'"'`)}'`);

// Returns the folder of the results: that of the page if it was opened from a disk, since it may have been moved.
function folderOf(written) {
  if (location.protocol !== "file:") return written;
  try {
    const folder = decodeURIComponent(location.pathname).replace(/\/[^/]*$/, "");
    return /^\/[A-Za-z]:/.test(folder) ? folder.slice(1) : folder || "/";
  } catch {
    return written; // the folder's name is not UTF-8
  }
}

class Cases {
  // cases: the values of the rows, the worst case first. handlers: choose(case).
  constructor(cases, folder, handlers) {
    Object.assign(this, { cases, folder, handlers, ticked: new Set(), shown: [], current: null });
    this.rows = new Map(all(".row").map((row) => [Number(row.dataset.index), row]));
    this.list = find("list");
    for (const name of ["text", "outcome", "verdict", "order", "grouped"]) {
      find(name)?.addEventListener("input", () => this.arrange());
    }
    find("filter").addEventListener("submit", (event) => event.preventDefault());
    this.list.addEventListener("click", (event) => this.clicked(event));
    this.list.addEventListener("change", (event) => this.changed(event));
    find("copy").addEventListener("click", () => this.copy());
    find("untick").addEventListener("click", () => this.tick([...this.ticked], false));
    find("as-variant").addEventListener("change", () => this.write());
    this.watch();
    this.arrange();
    this.write();
  }

  // Loads the thumbnails of rows when they come near to the window.
  watch() {
    const observer = new IntersectionObserver(
      (entries) => {
        for (const { target, isIntersecting } of entries) {
          if (!isIntersecting) continue;
          observer.unobserve(target);
          this.handlers.thumbnails(Number(target.dataset.index), target);
        }
      },
      { root: null, rootMargin: "600px" },
    );
    for (const row of this.rows.values()) observer.observe(row);
  }

  // Returns whether a case fits the filter.
  fits(one) {
    const words = find("text").value.toLowerCase().split(/\s+/).filter(Boolean);
    const outcome = find("outcome").value;
    const verdict = find("verdict")?.value ?? "";
    const text = [one.id, one.name, one.label, one.reason, one.group].join("\n").toLowerCase();
    if (outcome === "failures" ? one.outcome === "same" : outcome !== "all" && one.outcome !== outcome) return false;
    return (!verdict || one.verdict === verdict) && words.every((word) => text.includes(word));
  }

  sorted(cases) {
    const order = find("order").value;
    if (order === "name") return cases.toSorted((a, b) => a.name.localeCompare(b.name, undefined, { numeric: true }));
    if (order === "change") return cases.toSorted((a, b) => (b.change ?? Infinity) - (a.change ?? Infinity) || a.index - b.index);
    return cases;
  }

  // Puts the rows that fit the filter into the list, in order.
  arrange() {
    const fitting = this.sorted(this.cases.filter((one) => this.fits(one)));
    const groups = new Map();
    for (const one of fitting) {
      const key = find("grouped").checked && one.group && one.outcome !== "same" ? `${one.label}\n${one.group}` : `\n${one.index}`;
      groups.set(key, [...(groups.get(key) ?? []), one]);
    }
    const open = fitting.length <= MOST_OPEN;
    this.shown = [...groups.values()].flat();
    this.list.replaceChildren(...[...groups.values()].map((members) => this.item(members, open)));
    find("none").hidden = fitting.length > 0;
    const of = fitting.length === this.cases.length ? "" : ` of ${this.cases.length}`;
    find("number").textContent = `${fitting.length}${of} ${this.cases.length === 1 ? "case" : "cases"}`;
    this.focusable();
  }

  // Returns the row of a case, or a group of rows with an equal cause.
  item(members, open) {
    const rows = members.map((one) => this.rows.get(one.index));
    if (members.length === 1) return rows[0];
    const approvable = members.filter((one) => one.approvable);
    const box = element("input", { type: "checkbox", "aria-label": `Tick all ${members.length} cases of this group`, disabled: !approvable.length });
    const ticks = () => {
      const count = approvable.filter((one) => this.ticked.has(one.index)).length;
      box.checked = count > 0 && count === approvable.length;
      box.indeterminate = count > 0 && count < approvable.length;
    };
    box.addEventListener("click", (event) => event.stopPropagation());
    box.addEventListener("change", (event) => {
      event.stopPropagation();
      this.tick(approvable.map((one) => one.index), box.checked);
    });
    box.ticks = ticks;
    ticks();
    const summary = element(
      "summary",
      {},
      box,
      element("span", { class: `state ${members[0].kind}` }, members[0].label),
      element("span", { class: "count" }, `${members.length} cases`),
      element("span", { class: "cause" }, members[0].group),
      rows[0].querySelector(".thumbs").cloneNode(true),
    );
    this.handlers.thumbnails(members[0].index, summary);
    return element("li", { class: "group" }, element("details", { open: open }, summary, element("ul", {}, rows)));
  }

  clicked(event) {
    const link = event.target.closest(".open");
    if (!link || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    this.choose(this.cases[Number(link.closest(".row").dataset.index)], { clicked: true });
  }

  changed(event) {
    const row = event.target.closest(".row");
    if (row) this.tick([Number(row.dataset.index)], event.target.checked);
  }

  tick(indices, on) {
    for (const index of indices) {
      if (!this.cases[index].approvable) continue;
      this.ticked[on ? "add" : "delete"](index);
      const box = this.rows.get(index).querySelector("input");
      box.checked = on;
    }
    for (const box of all(".group summary input")) box.ticks();
    this.write();
  }

  toggle(one) {
    if (one?.approvable) this.tick([one.index], !this.ticked.has(one.index));
  }

  // Shows a case, and marks its row. reveal: whether to scroll to the row. clicked: whether a click has chosen it.
  choose(one, { reveal = false, clicked = false }) {
    this.rows.get(this.current?.index)?.querySelector(".open").removeAttribute("aria-current");
    this.current = one;
    const row = this.rows.get(one.index);
    row.querySelector(".open").setAttribute("aria-current", "true");
    this.focusable();
    if (reveal) {
      this.openGroup(row);
      row.scrollIntoView({ block: "nearest" });
    }
    this.handlers.choose(one, clicked);
  }

  // Goes to the next case in the list, or by `step` cases.
  go(step) {
    if (!this.shown.length) return;
    const here = this.shown.indexOf(this.current);
    const to = here < 0 ? 0 : Math.min(this.shown.length - 1, Math.max(0, here + step));
    const inList = this.list.contains(document.activeElement);
    this.choose(this.shown[to], { reveal: true });
    if (inList) this.focus();
  }

  // Gives the focus to the row of the case that is shown, or else to the first row.
  focus() {
    const row = this.rows.get((this.shown.includes(this.current) ? this.current : this.shown[0])?.index);
    if (!row) return document.activeElement.blur();
    this.openGroup(row);
    row.querySelector(".open").focus();
  }

  // Opens the group of a row, if it is in one: a row in a closed group cannot get the focus.
  openGroup(row) {
    const group = row.closest("details");
    if (group) group.open = true;
  }

  // The tab key stops at one row; the arrow keys go from row to row.
  focusable() {
    const stop = this.shown.includes(this.current) ? this.current : this.shown[0];
    for (const [index, row] of this.rows) {
      for (const part of all("a, input", row)) part.tabIndex = index === stop?.index ? 0 : -1;
    }
  }

  // Returns the command that approves what is ticked.
  command() {
    const ticked = this.cases.filter((one) => this.ticked.has(one.index));
    const words = ["glshade", "approve", this.folder, ...ticked.flatMap((one) => ["--only", one.only])];
    if (find("as-variant").checked && !find("variant").hidden) words.push("--as-variant", ticked[0].variant);
    return words.map(quoted).join(" ");
  }

  write() {
    const ticked = this.cases.filter((one) => this.ticked.has(one.index));
    const variant = ticked[0]?.variant;
    find("variant").hidden = !variant || !ticked.every((one) => one.variant === variant);
    find("driver").textContent = variant ?? "";
    find("approve").hidden = !ticked.length;
    find("ticked").textContent = `${ticked.length} ticked`;
    find("command").value = this.command();
    find("copied").textContent = "";
  }

  // Copies the command. Without the right to use the clipboard, the text is selected for the reader to copy.
  async copy() {
    if (!this.ticked.size) return announce("Tick a case first.");
    const field = find("command");
    try {
      await navigator.clipboard.writeText(field.value);
      find("copied").textContent = "Copied. Run it in a terminal.";
    } catch {
      field.focus();
      field.select();
      find("copied").textContent = document.execCommand("copy") ? "Copied. Run it in a terminal." : "Selected. Copy it with Ctrl+C.";
    }
  }
}

// Tells a screen reader a sentence, without moving the focus.
function announce(text) {
  find("announcement").textContent = text;
}
