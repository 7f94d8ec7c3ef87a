// The problems of the last save, each with its place, an excerpt of the file and a caret.

import { element, find } from "./dom.js";

const place = ({ file, line, column }) => [file, line, column].filter((part) => part !== null && part !== undefined).join(":");

export function showProblems({ problems, stale, stale_of: revision }) {
  const section = find("problems");
  section.hidden = problems.length === 0;
  const count = problems.length === 1 ? "1 problem" : `${problems.length} problems`;
  const shown = stale ? `. The picture is that of revision ${revision}.` : "";
  const title = element("h2", { id: "problems-title" }, count, element("span", { class: "quiet" }, shown));
  section.replaceChildren(title, ...problems.map(article));
  for (const mark of section.querySelectorAll(".mark")) {
    const box = mark.closest(".excerpt");
    box.scrollLeft = mark.offsetLeft - 0.8 * box.clientWidth; // a narrow screen would cut the caret off
  }
  return problems.length ? `${count}: ${problems[0].message}` : "";
}

function article(problem) {
  const stage = problem.stage ? element("span", { class: "tag" }, problem.stage) : null;
  return element(
    "article",
    { class: "problem" },
    element("h3", {}, element("code", {}, place(problem)), stage),
    element("p", {}, problem.message),
    problem.excerpt?.length ? excerpt(problem) : null,
  );
}

// Lines with their numbers; the faulty line is marked, and a caret stands below its column.
function excerpt({ excerpt: lines, first_line: first, line, caret }) {
  const width = String(first + lines.length - 1).length;
  const rows = lines.flatMap((text, index) => {
    const number = first + index;
    const faulty = number === line;
    const row = element(
      "span",
      { class: faulty ? "row faulty" : "row" },
      element("span", { class: "number" }, String(number).padStart(width)),
      ` ${text}\n`,
    );
    if (!faulty || !caret) return [row];
    // Tabs are kept, so that the caret stands below its character however wide a tab is shown.
    const blank = text.slice(0, caret - 1).replaceAll(/[^\t]/g, " ");
    const mark = element("span", { class: "mark" }, "^");
    return [row, element("span", { class: "row caret", "aria-hidden": "true" }, `${" ".repeat(width)} ${blank}`, mark, "\n")];
  });
  return element("pre", { class: "excerpt", tabindex: "0", "aria-label": "Excerpt of the file" }, ...rows);
}
