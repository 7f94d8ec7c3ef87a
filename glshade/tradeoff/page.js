// The page of a study: shows the setting that is pointed at or chosen, sorts the table, and switches the metric.

const points = data("points");
const { floor, least, greatest, first } = data("settings");
const metric = () => document.querySelector("[name=metric]:checked").value;
const panel = find("panel");
// The points in the panel: the one that was clicked, and the one that is shown.
let pinned = first;
let current = first;

const ms = (seconds) => (seconds * 1e3).toPrecision(3);

function show(i) {
  current = i;
  const p = points[i];
  const m = metric();
  const by = p.by[m];
  const facts = { time: `${ms(p.time[0])} ms (${ms(p.time[1])} to ${ms(p.time[2])})`, vertices: p.vertices.toLocaleString("en"), [m]: p.total[m] };
  panel.replaceChildren(
    element("h2", { class: p.rate }, p.name),
    element("p", { class: "where quiet" }, by === null ? "On the front." : `Dominated by ${points[by].name}: ${p.why[m]}.`),
    element("dl", {}, Object.entries(facts).map(([name, value]) => [element("dt", {}, name), element("dd", {}, value)])),
    element("div", { class: "pair" }, p.picture ? pictures(p) : element("div", { class: "none" }, "the page has no picture of this setting")),
    element(
      "div",
      { class: "kinds" },
      Object.keys(p.kinds[m]).map((kind) => bar(kind, p.kinds[m][kind], p.bars[m][kind])),
      bar("floor", floor.text[m], floor.bar[m]),
    ),
  );
  for (const mark of all(".mark[data-i]")) {
    mark.classList.toggle("on", Number(mark.dataset.i) === i);
    mark.classList.toggle("by", Number(mark.dataset.i) === by);
  }
  for (const line of all("tbody tr")) line.classList.toggle("on", Number(line.dataset.i) === i);
}

// Returns the picture of a point and its error map, each with a link to its file if it has one.
function pictures(p) {
  const captions = { picture: "picture", error: "error, largest channel, logarithmic" };
  return Object.entries(captions).map(([kind, caption]) => {
    const image = element("img", { class: "pixels", src: `data:image/jpeg;base64,${p[kind]}`, alt: caption });
    const address = `pictures/${p.file}${kind === "error" ? "-error" : ""}.png`;
    const ends = [`${least} or less`, caption, greatest].map((text) => element("span", {}, text));
    return element(
      "figure",
      {},
      p.file ? element("a", { href: address }, image) : image,
      kind === "error" ? [element("div", { class: "ramp" }), element("div", { class: "ends" }, ends)] : [],
    );
  });
}

// Returns a name, a bar of a length [percent], and a value.
function bar(name, text, length) {
  const { namespaceURI } = document.querySelector("svg");
  const shape = document.createElementNS(namespaceURI, "svg");
  const area = document.createElementNS(namespaceURI, "rect");
  for (const [key, value] of Object.entries({ class: "b", viewBox: "0 0 100 1", preserveAspectRatio: "none" })) shape.setAttribute(key, value);
  area.setAttribute("width", length);
  area.setAttribute("height", 1);
  shape.append(area);
  return [element("b", {}, name), element("span", { class: name }, shape), element("span", { class: "v" }, text)];
}

for (const chart of all("svg[data-metric]")) {
  const marks = all(".mark[data-i]", chart).map(({ dataset, classList }) => [Number(dataset.x), Number(dataset.y), Number(dataset.i), classList.contains("front")]);
  const nearest = (event) => {
    const p = new DOMPoint(event.clientX, event.clientY).matrixTransform(chart.getScreenCTM().inverse());
    let best = null;
    let distance = 26; // a point that is further away is not meant [SVG units]
    for (const [x, y, i, front] of marks) {
      const d = Math.hypot(x - p.x, y - p.y) - (front ? 3 : 0);
      if (d < distance) [best, distance] = [i, d];
    }
    return best;
  };
  const pointed = (event, action) => {
    const i = nearest(event);
    if (i !== null) action(i);
  };
  chart.addEventListener("pointermove", (event) => pointed(event, show));
  chart.addEventListener("pointerleave", () => show(pinned));
  chart.addEventListener("click", (event) => pointed(event, (i) => show((pinned = i))));
}
for (const line of all("tbody tr")) {
  line.addEventListener("pointerenter", () => show(Number(line.dataset.i)));
  line.addEventListener("pointerleave", () => show(pinned));
  line.addEventListener("click", () => show((pinned = Number(line.dataset.i))));
}

const table = find("all");
const heads = all("th", table);
const key = (text) => (text === "inf" ? Infinity : Number(text));
function sort(column, down) {
  const value = (row) => row.cells[column].dataset.v;
  const number = column > 0;
  const rows = [...table.tBodies[0].rows].sort((a, b) => (number ? key(value(a)) - key(value(b)) : value(a).localeCompare(value(b))));
  table.tBodies[0].append(...(down ? rows.reverse() : rows));
  heads.forEach((head, i) => (i === column ? head.setAttribute("aria-sort", down ? "descending" : "ascending") : head.removeAttribute("aria-sort")));
}
heads.forEach((head, i) => head.querySelector("button")?.addEventListener("click", () => sort(i, head.getAttribute("aria-sort") === "ascending")));

function changed() {
  const m = metric();
  for (const part of all("[data-for]")) part.toggleAttribute("hidden", part.dataset.for !== m);
  for (const row of table.tBodies[0].rows) row.classList.toggle("faded", points[row.dataset.i].by[m] !== null);
  show(current);
}
for (const input of all("[name=metric]")) input.addEventListener("change", changed);
sort(1, false);
changed();
