// Main: joins the list, the stage and the keyboard.

const settings = data("settings");
const rows = data("cases");
const store = new Store();
let cases = null;
let stage = null;

const step = (exposure) => (exposure > 0 ? "+" : "") + exposure.toFixed(2).replace(/\.?0+$/, "");

// Shows a case: at once by its thumbnails, and by its exact pictures as soon as they are decoded.
async function show(one, clicked) {
  const stored = store.embedded(one.index);
  find("title").textContent = one.name;
  find("state").textContent = one.label;
  find("state").className = `state ${one.kind}`;
  const why = one.causes.map(({ text }) => text).join("; ");
  const reason = one.reason || (one.outcome === "same" ? "The rule finds no difference." : "");
  find("reason").replaceChildren(element("b", {}, why), why && reason ? ": " : "", reason);
  find("details").replaceChildren(...details(one, stored));
  find("case").classList.add("chosen");
  document.body.dataset.case = one.index;
  remember(one, clicked);
  fill(find("tick"), one);
  const exact = await store.get(one.index);
  const images = await fallbacks(one, stored, exact);
  if (cases.current !== one) return;
  const size = sizeOf(exact, images);
  stage.show(exact, images, size);
  find("exposed").hidden = !Object.values(exact).some((picture) => picture.floats);
  const differing = stage.differences ? `${stage.differences.count.toLocaleString("en")} pixels differ` : "";
  const parts = [stored.layer ? `layer ${stored.layer}` : "", size[0] > 1 ? `${size[0]} × ${size[1]}` : "", notice(exact, images), differing];
  find("notice").textContent = parts.filter(Boolean).join(", ");
  for (const input of all("#modes input")) input.disabled = !stage.offers(input.value);
  const { differences } = stage;
  find("worst").disabled = !differences?.worst;
  const floats = Object.values(exact).some((picture) => picture.floats);
  find("least").textContent = floats ? "equal, then 1e-5" : "equal, then 1 code";
  find("greatest").textContent = floats ? "1 and more" : "255 codes";
  find("broken").hidden = !floats;
  readout(stage, null, settings.classes);
  announce(`${one.name}: ${one.label}. ${find("reason").textContent}`);
  document.body.dataset.shown = one.index;
  const next = cases.shown[cases.shown.indexOf(one) + 1];
  if (next) setTimeout(() => cases.current === one && store.get(next.index), 150);
}

// Puts the case into the address, so that the browser's way back leads from a case that was clicked to the one before.
function remember(one, clicked) {
  const address = `#case-${one.index}`;
  if (location.hash !== address) history[clicked ? "pushState" : "replaceState"](null, "", address);
}

const sizeOf = (exact, images) => {
  const known = [...Object.values(exact).map(({ width, height }) => [width, height]), ...Object.values(images).map(({ naturalWidth: w, naturalHeight: h }) => [w, h])];
  return [0, 1].map((i) => Math.max(1, ...known.map((size) => size[i])));
};

function notice(exact, images) {
  const values = Object.values(exact);
  if (values.some((picture) => picture.floats)) return "float32, shown sRGB-encoded";
  if (values.length) return "8-bit codes";
  if (!Object.keys(images).length) return "no picture";
  return images.small ? "thumbnails only: the pictures are files beside this page" : "";
}

// Returns role -> image of the pictures whose values are not there: the files beside the page, or else the thumbnails.
async function fallbacks(one, stored, exact) {
  const images = {};
  const missing = ["expected", "actual", "classes"].filter((role) => !exact[role]);
  await Promise.all(
    missing.map(async (role) => {
      const file = one.files[role]?.endsWith(".png") ? await loaded(one.files[role]) : null;
      const image = file ?? (stored.thumbnails?.[role] ? await loaded(stored.thumbnails[role]) : null);
      if (image && !file) Object.defineProperty(images, "small", { value: true, configurable: true });
      if (image) images[role] = image;
    }),
  );
  if (!exact.actual && stored.thumbnails?.difference) images.difference = await loaded(stored.thumbnails.difference);
  return images;
}

// Returns an image once it is loaded; null if it cannot be.
function loaded(address) {
  return new Promise((resolve) => {
    const image = new Image();
    image.onload = () => resolve(image);
    image.onerror = () => resolve(null);
    image.src = address;
  });
}

function thumbnails(index, row) {
  const { thumbnails = {} } = store.embedded(index);
  const { files } = rows[index];
  for (const image of all("img", row)) {
    const role = image.dataset.role;
    const address = thumbnails[role] ?? (files[role]?.endsWith(".png") && role === "actual" ? files[role] : null);
    if (address) image.src = address;
  }
}

// Makes the tick beside the title that of the case.
function fill(box, one) {
  box.disabled = !one.approvable;
  box.checked = cases.ticked.has(one.index);
}

const setMode = (mode) => {
  for (const input of all("#modes input")) input.checked = input.value === mode;
  stage.choose(mode);
};

stage = new Stage(settings.ramp, {
  point: (pixel) => readout(stage, pixel, settings.classes),
  mode: (mode) => {
    find("playing").hidden = mode !== "blink";
    find("legend").hidden = mode !== "classes";
    find("scale").hidden = mode !== "difference";
  },
  zoom: (scale) => (find("zoom").textContent = `${Math.round(100 * scale)} %`),
  blink: (playing) => (find("playing").textContent = playing ? "Pause" : "Play"),
});

cases = new Cases(rows, folderOf(settings.folder), { choose: show, thumbnails });

const setExposure = (value) => {
  const slider = find("exposure");
  slider.value = value;
  find("stops").textContent = `${step(Number(slider.value))} EV`;
  stage.expose(2 ** Number(slider.value));
};

// Shows the list alone on a narrow screen.
function list() {
  delete document.body.dataset.case;
  cases.focus();
}

const help = find("help");
const changeTick = () => {
  if (!cases.current) return;
  cases.toggle(cases.current);
  fill(find("tick"), cases.current);
};

find("modes").addEventListener("change", (event) => setMode(event.target.value));
find("exposure").addEventListener("input", (event) => setExposure(event.target.value));
find("exposure").addEventListener("dblclick", () => setExposure(0));
find("tick").addEventListener("change", changeTick);
find("list").addEventListener("change", () => cases.current && fill(find("tick"), cases.current));
find("untick").addEventListener("click", () => cases.current && fill(find("tick"), cases.current));
const actions = {
  next: () => cases.go(1),
  previous: () => cases.go(-1),
  in: () => stage.zoom(ZOOM),
  out: () => stage.zoom(1 / ZOOM),
  fit: () => stage.fit(),
  whole: () => stage.zoom(1 / stage.scale),
  worst: () => stage.differences?.worst && stage.goTo(stage.differences.worst),
  playing: () => stage.play(!stage.playing),
  back: () => {
    history.replaceState(null, "", location.pathname);
    list();
  },
  keys: () => (help.open ? help.close() : help.showModal()),
};
for (const [id, action] of Object.entries(actions)) for (const button of all(`[data-do="${id}"]`)) button.addEventListener("click", action);

const KEYS = {
  j: actions.next,
  k: actions.previous,
  x: changeTick,
  y: () => cases.copy(),
  s: () => setMode("side"),
  w: () => setMode("swipe"),
  b: () => setMode("blink"),
  d: () => setMode("difference"),
  e: () => setMode("expected"),
  a: () => setMode("actual"),
  c: () => setMode("classes"),
  n: actions.worst,
  f: () => {
    const select = find("outcome");
    select.value = select.value === "failures" ? "all" : "failures";
    cases.arrange();
  },
  "/": () => find("text").focus(),
  "?": actions.keys,
  "+": actions.in,
  "=": actions.in,
  "-": actions.out,
  0: actions.fit,
  1: actions.whole,
  "[": () => setExposure(Number(find("exposure").value) - 0.5),
  "]": () => setExposure(Number(find("exposure").value) + 0.5),
};
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

// Keys of the stage alone: arrows move the picture, and with Shift the marked pixel.
function stageKey(event) {
  const arrow = ARROWS[event.key];
  const [width, height] = stage.room();
  if (arrow && event.shiftKey) {
    stage.step(arrow);
    if (stage.cross) announce(`${find("place").textContent} ${find("class").textContent}: ${readout(stage, stage.cross, settings.classes)}`);
  } else if (arrow) stage.pan(-arrow[0] * PAN * width, -arrow[1] * PAN * height);
  else if (event.key === " " && stage.used === "blink") {
    stage.play(false);
    stage.swap();
    announce(stage.second ? "Actual" : "Expected");
  } else return false;
  return true;
}

addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.key === "Escape" && event.target === find("text")) {
    find("text").value = "";
    cases.arrange();
    cases.focus();
    return;
  }
  const typing = event.target.matches("input[type=search], textarea, select, input[type=range]");
  if (help.open && event.key !== "?") return;
  if (typing) return;
  const inList = event.target.closest("#list");
  if (event.target === stage.root && stageKey(event)) event.preventDefault();
  else if (inList && event.key === "ArrowDown") actions.next();
  else if (inList && event.key === "ArrowUp") actions.previous();
  else if (KEYS[event.key]) KEYS[event.key]();
  else return;
  event.preventDefault();
});

// Opens the case that the address names, or else the worst one; on a narrow screen, the list comes first.
function open() {
  const named = rows[Number(location.hash.match(/^#case-(\d+)$/)?.[1] ?? -1)];
  const first = named ?? cases.shown[0];
  if (named && !cases.shown.includes(named)) {
    find("outcome").value = "all";
    cases.arrange();
  }
  if (named || (first && !matchMedia("(max-width: 820px)").matches)) cases.choose(first, { reveal: Boolean(named) });
  else delete document.body.dataset.case;
}

addEventListener("popstate", open);
open();
