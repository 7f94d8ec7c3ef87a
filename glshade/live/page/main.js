// The page of `glshade dev`: connects the parts. Data flows one way: a gesture changes the view, the view goes to the server,
// and a frame comes back.

import { orbit, pan, rounded, zoom } from "./camera.js";
import { Changes } from "./changes.js";
import { Connection } from "./connection.js";
import { Controls } from "./controls.js";
import { announce, element, find, tabs } from "./dom.js";
import { hideProbe, showProbe, showTrace } from "./probe.js";
import { showProblems } from "./problems.js";
import { showPrograms } from "./programs.js";
import { Source } from "./source.js";
import { Stage } from "./stage.js";
import { belongs, options, Values } from "./values.js";
import { Verdict } from "./verdict.js";
import { isJudged, isSlow, Views } from "./views.js";

const SETTLED = 180; // after this pause in a movement, a still picture is asked for [ms]
const STOOD_STILL = 500; // a still picture is judged after this time [ms]
const PACE = 8; // the rate of frames is the mean over this many frames

const state = {
  server: null, // the last state message
  camera: 0, // index in the scene's cameras
  moved: null, // the camera after a gesture; null: as in the scene
  number: 0, // of the last view that was sent
  written: null, // keys that were written into the file, whose new revision has not come yet
  scheduled: false, // whether a view will be sent before the next repaint
  moving: false,
  settle: 0, // timer: the movement has ended
  judge: 0, // timer: the picture has stood still
  lost: "", // why there is no connection; empty while there is one
  refusal: "", // why the last request was refused
  times: [], // of the last frames of a movement [ms]
};

const values = new Values((moving) => {
  followCamera();
  controls.update();
  changes.update();
  source.forget();
  request(moving);
});
const controls = new Controls(values);
const changes = new Changes(values, { options: everyChange, write: writeBack });
const views = new Views(() => {
  arrange();
  request(false);
});
const stage = new Stage({
  orbit: (yaw, pitch) => move((camera) => orbit(camera, yaw, pitch)),
  pan: (dx, dy) => move((camera) => pan(camera, dx, dy)),
  zoom: (factor) => move((camera) => zoom(camera, factor)),
  reset,
  click,
  cross: (x, y) => stage.cross([x, y]),
  clear,
});
const verdict = new Verdict({ mark: (pixels) => stage.mark(pixels), probe: (x, y) => probe(0, x, y) });
const source = new Source({
  files: (object) => connection.send({ type: "source", object }),
  digits: (object) => connection.send({ type: "digits", object }),
});
const connection = new Connection({ opened, closed, message, frame });

// --- the view, to the server --------------------------------------------------------------------------------------------

function sceneCamera() {
  return state.server?.info.cameras?.[state.camera] ?? null;
}

function move(change) {
  const camera = state.moved ?? sceneCamera();
  if (!camera) return;
  state.moved = change(camera);
  clear();
  changes.update();
  request(true);
}

function reset() {
  state.moved = null;
  clear();
  changes.update();
  request(false);
}

// A camera that was moved by hand also follows a changed value of the camera.
function followCamera() {
  if (!state.moved) return;
  const { "camera.fov": fov, "camera.height": height } = values.set;
  if (state.moved.type === "perspective" && fov) state.moved = { ...state.moved, fov };
  if (state.moved.type === "orthographic" && height) state.moved = { ...state.moved, height };
}

function camera() {
  if (state.moved) return rounded(state.moved);
  const { name } = sceneCamera() ?? {};
  return name ? { name } : null;
}

// Asks for a picture before the next repaint. A movement ends with a still picture.
function request(moving) {
  clearTimeout(state.settle);
  clearTimeout(state.judge);
  if (state.refusal) {
    state.refusal = "";
    notify();
  }
  state.moving = moving;
  if (moving) state.settle = setTimeout(() => request(false), SETTLED);
  if (state.scheduled) return;
  state.scheduled = true;
  requestAnimationFrame(() => {
    state.scheduled = false;
    const shared = { camera: camera(), set: values.set };
    const panes = views.panes.map(({ view }) => ({ ...shared, ...view }));
    views.panes.forEach(({ choice }, index) => stage.panes[index].wait(isSlow(choice)));
    connection.send({ type: "view", number: ++state.number, moving: state.moving, panes });
  });
}

function click(pane, x, y) {
  if (stage.tool === "probe") probe(pane, x, y);
  else connection.send({ type: "pick", pane, x, y });
}

function probe(pane, x, y) {
  stage.cross([x, y]);
  connection.send({ type: "probe", pane, x, y });
}

// Whether an answer is about the pixel under the cross.
function isProbed({ x, y }) {
  const cross = stage.panes[0].cross;
  return cross?.[0] === x && cross?.[1] === y;
}

function clear() {
  stage.cross(null);
  hideProbe();
}

function writeBack() {
  connection.send({ type: "write", values: values.set });
}

// The options that set the changed values, and the camera where it was moved or another was chosen.
function everyChange() {
  if (!state.moved) return options(values.set, sceneCamera()?.name);
  const others = Object.entries(values.set).filter(([key]) => !belongs(key, "camera"));
  return options({ ...Object.fromEntries(others), camera: rounded(state.moved) }, null);
}

// --- messages, from the server ------------------------------------------------------------------------------------------

const RECEIVE = {
  state: received,
  picked: ({ key, object, material }) => {
    controls.select(key ?? null);
    const index = state.server.info.objects.findIndex((candidate) => candidate.key === key);
    if (source.visible && index >= 0) source.choose(index);
    else tab(find("tab-values"));
    announce(object ? `${object}, material ${material}` : "Background");
  },
  probed: (answer) => {
    const { canvas, size } = stage.panes[answer.pane ?? 0];
    showProbe(answer, canvas, canvas.width / size[0]);
  },
  traced: (answer) => {
    if (!isProbed(answer)) return;
    const open = (step) => {
      source.choose(answer.object, step);
      if (!source.visible) tab(find("tab-source"));
    };
    showTrace(answer, { open, show: (step) => showVariable({ ...step, object: answer.object }) });
  },
  source: (answer) => source.receive(answer),
  digits: (answer) => source.receiveDigits(answer),
  judged: (answer) => {
    verdict.show(answer);
    // A measurement that another view has cancelled is made now, while the judge is idle.
    if (answer.state !== "judging") source.measure();
  },
  written: ({ ok, text }) => {
    if (ok) state.written = Object.keys(values.set);
    changes.say(text, ok);
  },
  error: ({ text }) => {
    state.refusal = text;
    notify();
  },
};

function message(answer) {
  RECEIVE[answer.type]?.(answer);
}

function received(server) {
  const first = !state.server;
  const news = first || server.revision !== state.server.revision;
  state.server = server;
  const { info, controls: { groups = [] } = {} } = server;
  find("scene").textContent = server.scene;
  find("revision").textContent = `revision ${server.revision}`;
  document.title = `${server.problems.length ? "✕ " : ""}${server.scene} – glshade dev`;
  if (info.size) stage.resize(...info.size);
  views.fill(info.layers ?? []);
  fillCameras(info.cameras ?? []);
  controls.show(groups, info.objects ?? []);
  source.renew(server.stale ? server.stale_of : server.revision, info.objects ?? []);
  showPrograms(info, server.milliseconds);
  const spoken = showProblems(server);
  notify();
  if (news) announce(spoken || `Revision ${server.revision}`);
  if (news && !first) {
    verdict.show({ state: "none" });
    clear();
  }
  if (forget(news) || first) request(false);
}

// Drops the changed values that a new revision has in its file, and those that the scene no longer takes.
function forget(news) {
  const written = (news && state.written) || [];
  // The controls of a revision do not list the parameters of a model that was chosen on the page.
  const isOfOtherModel = (key) => Object.keys(values.set).some((whole) => belongs(key, whole));
  const dropped = values.keep((key, value) => !written.includes(key) && (controls.fits(key, value) || isOfOtherModel(key)));
  if (news) state.written = null;
  controls.update();
  changes.update();
  return dropped;
}

function fillCameras(cameras) {
  const select = find("camera");
  select.parentElement.hidden = cameras.length < 2;
  const names = cameras.map(({ name }) => name ?? "Scene");
  if (names.join("\n") === [...select.options].map(({ text }) => text).join("\n")) return;
  select.replaceChildren(...names.map((name) => element("option", {}, name)));
  if (state.camera >= cameras.length) state.camera = 0;
  select.selectedIndex = state.camera;
}

async function frame(pane, header, blob) {
  const shown = await stage.show(pane, header, blob);
  connection.send({ type: "shown", pane, number: header.number });
  if (!shown || pane !== 0) return;
  status(header);
  // A changed model has other parameters, which the frame brings along.
  if (header.ignored?.length) changes.say(`The scene does not take ${header.ignored.join(", ")}.`, false);
  if (header.still) controls.show((header.controls ?? state.server.controls).groups, state.server.info.objects ?? []);
  document.dispatchEvent(new CustomEvent("glshade:frame", { detail: header }));
  clearTimeout(state.judge);
  const current = header.still && header.width && !state.moving && header.number === state.number;
  if (current && !isJudged(views.panes[0].choice)) source.measure();
  else if (current) state.judge = setTimeout(() => connection.send({ type: "judge" }), STOOD_STILL);
}

function status({ width, height, still, mime, milliseconds = {}, non_finite: bad }) {
  const steps = Object.entries(milliseconds).map(([step, ms]) => `${step.replaceAll("_", " ")} ${Math.round(ms)} ms`);
  state.times = [...(still ? [] : state.times), performance.now()].slice(-PACE);
  const pace = (1000 * (state.times.length - 1)) / (state.times.at(-1) - state.times[0]);
  const rate = still || !Number.isFinite(pace) ? "" : `${Math.round(pace)} frames/s`;
  const kind = mime === "image/png" ? "lossless" : "JPEG";
  const broken = bad === 1 ? "1 pixel is NaN or infinite" : `${bad || "no"} pixels are NaN or infinite`;
  const counted = typeof bad === "number"; // only where they are painted
  const parts = [counted ? broken : "", `${width} × ${height}`, kind, ...steps, rate];
  find("status").textContent = parts.filter(Boolean).join("  ·  ");
}

// Says what keeps the picture from being that of the newest revision, or why a request was refused.
function notify() {
  const text = state.lost || noticeOf(state.server) || state.refusal;
  const place = find("notice");
  place.hidden = !text;
  place.textContent = text;
  find("stage").classList.toggle("stale", Boolean(state.server?.stale || state.lost));
}

function noticeOf(server) {
  if (server?.drawer === "lost") return "The drawer was lost; a new one starts.";
  if (server?.drawer === "starting") return "The drawer starts …";
  return server?.stale ? `stale: revision ${server.stale_of}` : "";
}

function opened() {
  state.lost = "";
  notify();
  if (state.server) request(false);
}

function closed(text) {
  state.lost = text;
  notify();
  announce(text);
}

// --- the toolbar --------------------------------------------------------------------------------------------------------

function place() {
  stage.arrange(views.layout);
  views.panes.forEach(({ title }, index) => (stage.panes[index].caption.textContent = title));
}

// Shows a variable beside the picture; the probe that lists it stays.
function showVariable(variable) {
  views.show(variable);
  place();
  request(false);
}

function arrange() {
  place();
  verdict.show({ state: "none" });
  clear();
}

const tab = tabs(document.querySelector("[role=tablist]"), () => source.visible && source.ask());
find("reset").addEventListener("click", reset);
find("camera").addEventListener("change", ({ target }) => {
  state.camera = target.selectedIndex;
  reset();
});
for (const input of document.querySelectorAll("[name=tool]")) {
  input.addEventListener("change", () => {
    stage.tool = input.value;
    clear();
  });
}
arrange();
