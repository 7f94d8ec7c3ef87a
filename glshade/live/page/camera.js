// Moves a camera: {type, eye, target, up, fov [degrees] or height [scene units]}. Every function returns a new camera.

const add = (a, b) => a.map((x, i) => x + b[i]);
const subtract = (a, b) => a.map((x, i) => x - b[i]);
const scale = (a, factor) => a.map((x) => x * factor);
const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = (a) => Math.hypot(...a);
const unit = (a) => scale(a, 1 / length(a));

// The eye stays this far from the axis `up`, because a view along the axis has no direction that points up in the picture.
const LEAST_ANGLE = 0.01;

// Returns a unit vector perpendicular to `axis`: the part of `direction` that is, or any if the two are parallel.
function across(direction, axis) {
  const part = subtract(direction, scale(axis, dot(direction, axis)));
  if (length(part) > 1e-6 * length(direction)) return unit(part);
  const smallest = axis.map(Math.abs).indexOf(Math.min(...axis.map(Math.abs)));
  return across([0, 1, 2].map((i) => (i === smallest ? 1 : 0)), axis);
}

// Turns the eye round the target: `yaw` about the axis `up`, `pitch` towards it [rad].
export function orbit(camera, yaw, pitch) {
  const up = unit(camera.up);
  const offset = subtract(camera.eye, camera.target);
  const away = across(offset, up);
  const turned = add(scale(away, Math.cos(yaw)), scale(cross(up, away), Math.sin(yaw)));
  const angle = Math.acos(Math.max(-1, Math.min(1, dot(unit(offset), up)))) - pitch;
  const clamped = Math.max(LEAST_ANGLE, Math.min(Math.PI - LEAST_ANGLE, angle));
  const direction = add(scale(up, Math.cos(clamped)), scale(turned, Math.sin(clamped)));
  return { ...camera, eye: add(camera.target, scale(direction, length(offset))) };
}

// Moves the camera such that the picture follows a drag by (dx, dy), in heights of the picture, y down.
export function pan(camera, dx, dy) {
  const offset = subtract(camera.eye, camera.target);
  const right = cross(unit(camera.up), across(offset, unit(camera.up)));
  const upward = cross(unit(offset), right);
  const seen = camera.type === "orthographic" ? camera.height : 2 * length(offset) * Math.tan((camera.fov * Math.PI) / 360);
  const move = scale(add(scale(right, -dx), scale(upward, dy)), seen);
  return { ...camera, eye: add(camera.eye, move), target: add(camera.target, move) };
}

// Brings the scene nearer: a factor below 1 enlarges it.
export function zoom(camera, factor) {
  if (camera.type === "orthographic") return { ...camera, height: camera.height * factor };
  const offset = subtract(camera.eye, camera.target);
  return { ...camera, eye: add(camera.target, scale(offset, factor)) };
}

// Rounds to 6 digits, which no picture can tell from the exact value. Texts for the command line stay short.
export function rounded(camera) {
  const short = (x) => Number(x.toPrecision(6));
  const { type, eye, target, up } = camera;
  const size = type === "orthographic" ? { height: short(camera.height) } : { fov: short(camera.fov) };
  return { type, eye: eye.map(short), target: target.map(short), up: up.map(short), ...size };
}
