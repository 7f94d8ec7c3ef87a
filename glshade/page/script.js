// Builds and finds elements. Every page's own script follows this one, in the same module.

const find = (id) => document.getElementById(id);
const all = (selector, parent = document) => [...parent.querySelectorAll(selector)];

// Returns a new element. An attribute whose name starts with "on" is a listener; true sets an attribute without a value, and
// false, null and undefined leave it out. Children are elements and texts; a text is never taken for HTML.
function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (value !== false && value !== null && value !== undefined) made.setAttribute(name, value === true ? "" : value);
  }
  made.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined));
  return made;
}

// Returns the values that the template wrote into the element <script type="application/json" id="...">.
const data = (id) => JSON.parse(find(id).textContent);
