// Details: what is known about one case, in words and numbers below its pictures.

const brief = (value) => (typeof value === "number" ? String(Number(value.toPrecision(3))) : "");

// Returns the details of a case as elements. stored: what the page embeds for the case.
function details(one, stored) {
  return [
    one.causes.length ? section("Causes", causes(one.causes)) : null,
    one.layers.length ? section("Layers", layers(one.layers)) : null,
    Object.keys(one.distances).length > 1 ? section("Baselines, by their distance from the actual picture", distances(one.distances)) : null,
    section("Case", facts({ test: one.id, ...one.facts })),
    one.notes.length ? section("Notes", element("ul", {}, one.notes.map((note) => element("li", {}, note)))) : null,
    Object.keys(one.files).length ? section("Files", files(one.files)) : null,
    stored.reduced > 1 ? element("p", { class: "quiet" }, `The pictures are too large for the page, which shows one pixel of each ${stored.reduced} × ${stored.reduced}.`) : null,
  ].filter(Boolean);
}

const section = (title, content) => element("section", {}, element("h3", {}, title), content);

function causes(list) {
  const texts = ({ text, object, triangle, stage, pixels, explained }) => [
    text,
    object ? `${object}${triangle >= 0 ? `, triangle ${triangle}` : ""}` : "",
    stage ?? "",
    pixels ? `${pixels} ${pixels === 1 ? "pixel" : "pixels"}` : "",
    explained ? `explains ${Math.round(100 * explained)} %` : "",
  ];
  return element(
    "ul",
    { class: "causes" },
    list.map((cause) => {
      const [text, ...more] = texts(cause);
      return element("li", {}, element("b", {}, text), ...more.filter(Boolean).map((part) => element("span", { class: "quiet" }, part)));
    }),
  );
}

function layers(list) {
  const heads = ["layer", "outcome", "max", "RMSE", "p99.9", "codes", "FLIP", "reason"];
  const cells = (layer) => {
    const { worst, rmse, p999, codes, flip } = layer.metrics ?? {};
    return [layer.name || "picture", layer.outcome, brief(worst), brief(rmse), brief(p999), codes ?? "", brief(flip), layer.reason];
  };
  return table(heads, list.map(cells));
}

function distances(variants) {
  const rows = Object.entries(variants).sort((a, b) => a[1] - b[1]);
  return table(["baseline", "RMSE"], rows.map(([name, distance]) => [name, brief(distance)]));
}

function table(heads, rows) {
  const used = heads.map((_, i) => rows.some((row) => row[i] !== "")).map(Boolean);
  const numeric = (i) => (rows.every((row) => row[i] === "" || !Number.isNaN(Number(row[i]))) ? "n" : null);
  const line = (tag, cells) => element("tr", {}, cells.map((cell, i) => (used[i] ? element(tag, { class: numeric(i) }, String(cell)) : null)));
  return element(
    "div",
    { class: "wide", tabindex: 0, role: "region", "aria-label": heads.join(", ") },
    element("table", {}, element("thead", {}, line("th", heads)), element("tbody", {}, rows.map((row) => line("td", row)))),
  );
}

function facts(values) {
  return element("dl", {}, Object.entries(values).map(([name, text]) => [element("dt", {}, name), element("dd", {}, text)]));
}

function files(addresses) {
  return element(
    "p",
    { class: "files" },
    Object.entries(addresses).map(([role, address]) => element("a", { href: address }, `${role} picture`)),
  );
}

// Fills the table of the values of one pixel. stage: the stage, pixel: [column, row] or null.
function readout(stage, pixel, classes) {
  const { expected, actual, classes: map } = stage.exact;
  const names = (actual ?? expected)?.names ?? [];
  const rows = pixel ? [["expected", valuesAt(expected, pixel)], ["actual", valuesAt(actual, pixel)]] : [];
  const [a, b] = rows.map(([, values]) => values);
  if (a && b && a.length === b.length && expected.floats === actual.floats) rows.push(["difference", b.map((value, i) => value - a[i])]);
  const digits = (value, role, floats) => {
    if (!floats) return role === "difference" && value > 0 ? `+${value}` : String(value);
    return Number.isFinite(value) ? String(Number(value.toPrecision(role === "difference" ? 3 : 6))) : String(value);
  };
  const floats = Boolean((actual ?? expected)?.floats);
  const colour = pixel && valuesAt(map, pixel);
  const kind = colour && classes.find(({ colour: [r, g, b] }) => r === colour[0] && g === colour[1] && b === colour[2]);
  find("place").textContent = pixel ? `x ${pixel[0]}, y ${pixel[1]}` : "";
  find("hint").hidden = Boolean(pixel) || !names.length;
  find("class").textContent = kind ? kind.name : "";
  find("meaning").textContent = kind ? kind.meaning : "";
  find("channels").replaceChildren(element("td"), ...names.map((name) => element("th", { scope: "col" }, name)));
  for (const [i, role] of ["expected", "actual", "difference"].entries()) {
    const values = rows[i]?.[1];
    const cells = names.map((_, c) => element("td", {}, values ? digits(values[c], role, floats) : ""));
    find(`value-${role}`).replaceChildren(element("th", { scope: "row" }, role), ...cells);
  }
  return rows.map(([role, values]) => (values ? `${role} ${values.map((v) => digits(v, role, floats)).join(" ")}` : "")).join("; ");
}
