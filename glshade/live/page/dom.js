// Builds and finds elements.

export const find = (id) => document.getElementById(id);

// Returns a new element. An attribute whose name starts with "on" is a listener; true and false switch an attribute on and off.
export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (value === true) made.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) made.setAttribute(name, value);
  }
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}

// Returns a number with a few significant digits, as briefly as possible.
export function brief(value, digits) {
  const plain = Number(value.toPrecision(digits));
  return value !== 0 && Math.abs(value) < 1e-3 ? plain.toExponential() : String(plain);
}

// Tells a screen reader a sentence, without moving the focus.
export function announce(text) {
  find("announcement").textContent = text;
}

// Makes a tab list work: click, arrow keys, Home and End. `selected(tab)` is called after each choice.
export function tabs(list, selected = () => {}) {
  const all = [...list.querySelectorAll("[role=tab]")];
  const select = (chosen) => {
    for (const tab of all) {
      tab.setAttribute("aria-selected", tab === chosen);
      tab.tabIndex = tab === chosen ? 0 : -1;
      find(tab.getAttribute("aria-controls")).hidden = tab !== chosen;
    }
    selected(chosen);
  };
  const steps = { ArrowRight: 1, ArrowLeft: -1 };
  list.addEventListener("click", (event) => event.target.closest("[role=tab]") && select(event.target.closest("[role=tab]")));
  list.addEventListener("keydown", (event) => {
    const here = all.indexOf(document.activeElement);
    let next = null;
    if (event.key in steps) next = all[(here + steps[event.key] + all.length) % all.length];
    if (event.key === "Home") next = all[0];
    if (event.key === "End") next = all.at(-1);
    if (!next) return;
    event.preventDefault();
    select(next);
    next.focus();
  });
  return select;
}
