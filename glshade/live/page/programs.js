// The shader programs of the scene, why each is as it is, and the time that it took.

import { element, find } from "./dom.js";

// info: the facts about the scene; steps: step -> time of the last load [ms]
export function showPrograms({ programs = [], driver }, steps = {}) {
  const all = programs.every(({ rebuilt }) => rebuilt);
  const times = Object.entries(steps).map(timeOf);
  const closing = [
    programs.length === 1 ? "One program." : `${programs.length} programs.`,
    times.length ? `The last load took: ${times.join(", ")}.` : "",
    driver,
  ];
  find("programs").replaceChildren(...programs.map((program) => entry(program, !all)), element("p", { class: "quiet" }, closing.filter(Boolean).join(" ")));
}

const timeOf = ([step, ms]) => `${step.replaceAll("_", " ")} ${Math.round(ms)} ms`;

// tells: whether to tell the programs that were rebuilt from those that were kept
function entry({ name, objects, reasons, milliseconds, rebuilt, no_reference: alone }, tells) {
  const total = Object.values(milliseconds).reduce((sum, ms) => sum + ms, 0);
  const facts = [alone ? "no reference" : "", tells && rebuilt ? "rebuilt" : "", `${Math.round(total)} ms`];
  return element(
    "details",
    { class: "program" },
    element(
      "summary",
      {},
      element("span", { class: "name" }, name),
      element("span", { class: "figures quiet" }, facts.filter(Boolean).join(" · ")),
    ),
    element("p", { class: "quiet" }, `Draws ${objects.join(", ")}.`),
    element("ul", {}, ...reasons.map((reason) => element("li", {}, reason))),
  );
}
