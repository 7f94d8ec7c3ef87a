"""Searches: faults with numbers that have to be searched for: parameters, turned normals, lights that have moved."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.golden.change import ENOUGH, NAMED
from glshade.golden.faults.falloffs import directed
from glshade.golden.faults.fitting import FEWEST, FITTED, Fitting, SceneFault, in_doubt, literal
from glshade.golden.surfaces import Edit, Surfaces
from glshade.radiance.draw import Draw
from glshade.reference.raster import Fragments

Array = NDArray[Any]
Flags = NDArray[np.bool_]

# After this many objects that a search does not explain, it stops: the others are unlikely to have such a fault.
PATIENCE = 3
# The number of lights whose movement is looked for.
LIGHTS = 4
# The most steps of a search.
MOST_STEPS = 10
# The step of numerical derivatives, and the error from which on pixels count less in the search [share of white].
STEP, SMOOTH = 1e-3, 0.01
# A fault is not looked into if its linear effect explains less than this share of the change.
PROMISING = 0.3
# The logarithms of a parameter's factor from which the search for the best one starts.
STARTS = tuple(np.log([factor]) for factor in (1 / 64, 1 / 8, 1 / 2, 0.99, 1.01, 2.0, 8.0, 64.0))


def parameters(fitting: Fitting) -> Iterator[SceneFault]:
    """Yields the pictures with a parameter of the material multiplied by the factor that fits best."""
    failed = 0
    for draw in in_doubt(fitting):
        item = fitting.surfaces.inputs.draws[draw]
        best = 0.0
        for name in item.model.parameters():
            if not item.parameters[name].any():
                continue
            edit = _parameter_edit(name)
            found = _fitted(fitting, _only(fitting, draw, edit), STARTS, fitting.of(draw))
            if found is not None:
                text = f"{name} of {{objects}} x {np.exp(found[0][0]):.3g}"
                share = fitting.share(found[1], draw)
                best = max(best, share)
                yield SceneFault("parameter", text, "shading", found[1], whole=False, only=draw)
                if share >= NAMED:
                    yield from _on_all(fitting, "parameter", text, edit, found[0])
        failed += best < NAMED
        if failed == PATIENCE:
            return


def _on_all(fitting: Fitting, kind: str, text: str, edit: Callable[[Draw, Array], Draw], theta: Array) -> Iterator[SceneFault]:
    """Yields the picture in which all objects have the fault that was found for one of them."""
    light = fitting.surfaces.with_edit(lambda draw, _: edit(draw, theta))
    yield SceneFault(kind, text, "shading", light)


def _parameter_edit(name: str) -> Callable[[Draw, Array], Draw]:
    """Returns a function that multiplies the parameter of this name by exp(theta[0])."""

    def edit(draw: Draw, theta: Array) -> Draw:
        if name not in draw.parameters:
            return draw
        return replace(draw, parameters={**draw.parameters, name: draw.parameters[name] * np.exp(theta[0])})

    return edit


def normals_turned(fitting: Fitting) -> Iterator[SceneFault]:
    """Yields the pictures with the normals of one object turned, about the axis and by the angle that fit best."""
    failed = 0
    for draw in in_doubt(fitting):
        best = 0.0
        starts: tuple[Array, ...] = (np.zeros(3),)
        for edit in (_rotated, _tilted):
            found = _fitted(fitting, _only(fitting, draw, edit), starts, fitting.of(draw))
            if found is None or not found[0].any():
                break
            angle = np.degrees(np.linalg.norm(found[0]))
            text = f"normals of {{objects}} turned by {angle:.2g} degrees"
            share = fitting.share(found[1], draw)
            best = max(best, share)
            yield SceneFault("normals", text, "shading", found[1], whole=False, only=draw)
            if share >= NAMED:
                yield from _on_all(fitting, "normals", text, edit, found[0])
            if share >= ENOUGH:
                break
            size = float(np.linalg.norm(found[0])) / 4
            starts = (found[0], *(sign * size * axis for axis in np.eye(3) for sign in (-1, 1)))
        failed += best < NAMED
        if failed == PATIENCE:
            return


def _rotated(draw: Draw, theta: Array) -> Draw:
    """Returns a draw whose normals are rotated about an axis. theta: (3,), the axis times the angle [radians]."""
    return replace(draw, normal_from_object=_rotation(theta) @ draw.normal_from_object)


def _tilted(draw: Draw, theta: Array) -> Draw:
    """Returns a draw whose normals are all turned by the same angle, away from where they point about an axis.

    theta: (3,), the axis times the angle [radians].
    """
    mesh, angle = draw.instance.mesh, float(np.linalg.norm(theta))
    if mesh.normals is None or angle == 0:
        return draw
    normals = mesh.normals @ draw.normal_from_object.T
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    across = np.cross(normals, theta / angle)
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-30)
    turned = (normals + angle * across) @ np.linalg.inv(draw.normal_from_object).T
    turned /= np.maximum(np.linalg.norm(turned, axis=1, keepdims=True), 1e-30)
    return replace(draw, instance=replace(draw.instance, mesh=replace(mesh, normals=turned)))


def _rotation(vector: Array) -> Array:
    """Returns the matrix (3, 3) of a rotation, given as its axis times its angle (3,) [radians]."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_rotvec(vector).as_matrix())


def lights_moved(fitting: Fitting) -> Iterator[SceneFault]:
    """Yields the pictures with one light in another place or with another direction."""
    surfaces = fitting.surfaces
    for number, light in list(enumerate(surfaces.assembly.lights))[:LIGHTS]:
        for key in ("position", "direction"):
            if not hasattr(light, key):
                continue
            scale = _distance(surfaces, number) if key == "position" else 1.0

            def moved(theta: Array, number: int = number, key: str = key, scale: float = scale) -> Edit:
                return partial(_with_light_moved, surfaces, number=number, key=key, by=scale * theta)

            found = _fitted(fitting, moved, (np.zeros(3),), fitting.counts)
            if found is not None and found[0].any():
                by = ", ".join(f"{number:.3g}" for number in _rounded(scale * found[0]))
                text = f"{key} of light {literal(surfaces.light_name(number))} changed by ({by})"
                yield SceneFault("light", text, "shading", found[1], alone=False)


def _rounded(vector: Array) -> Array:
    """Returns a vector with its numbers rounded to about a hundredth of its largest one."""
    unit = 10.0 ** np.floor(np.log10(np.abs(vector).max())) / 100
    return np.asarray(np.rint(vector / unit) * unit + 0.0)


def _with_light_moved(surfaces: Surfaces, draw: Draw, _: Fragments, number: int, key: str, by: Array) -> Draw:
    """Returns a draw with one of its lights, given by its index in the assembly, moved or turned by a vector (3,)."""
    numbers = directed(surfaces, draw)
    if number not in numbers:
        return draw
    at = numbers.index(number)
    return replace(draw, lamps=(*draw.lamps[:at], _displaced(draw.lamps[at], key, by), *draw.lamps[at + 1 :]))


def _distance(surfaces: Surfaces, light: int) -> float:
    """Returns how far a light is from the eye, a length by which it may have moved [scene units]."""
    position = getattr(surfaces.assembly.lights[light], "position", None)
    return 1.0 if position is None else 0.1 * float(np.linalg.norm(np.subtract(position, surfaces.assembly.view.eye))) or 1.0


def _displaced(lamp: Any, key: str, by: Array) -> Any:
    """Returns a lamp with its position or direction changed; direction-like fields stay unit."""
    fields = [name for name in lamp.values if name == key or (key == "direction" and name in ("axis", "l", "to_light"))]
    values = dict(lamp.values)
    for name in fields:
        moved = values[name] + by
        unit = name != "position" and abs(np.linalg.norm(values[name]) - 1) < 1e-3
        values[name] = moved / np.linalg.norm(moved) if unit and moved.any() else moved
    return replace(lamp, values=values)


def _only(fitting: Fitting, number: int, change: Callable[[Draw, Array], Draw]) -> Callable[[Array], Edit]:
    """Returns a function from the numbers of a fault (P,) to an edit that gives one draw the fault."""
    chosen = fitting.surfaces.inputs.draws[number]
    return lambda theta: lambda draw, _: change(draw, theta) if draw is chosen else draw


def _fitted(
    fitting: Fitting, edit_of: Callable[[Array], Edit], starts: Sequence[Array], where: Flags
) -> tuple[Array, Array] | None:
    """Returns the numbers (P,) of a fault that explain the change best, and the light (K, 3) with that fault.

    It returns None where there are too few pixels, and where the fault is not likely: no start makes the error smaller than it
    is without a fault, or, from a start of zeros, the linear effect explains little.
    edit_of: a function from the numbers to an edit. Zeros are no fault.
    starts: numbers from which the search starts; it goes on from the best of them.
    where: (K,), the pixels that count.
    """
    from scipy.optimize import least_squares

    change = fitting.change
    numbers, quiet = (np.flatnonzero(where & (change.amount > 0)), np.flatnonzero(where & (change.amount == 0)))
    if len(numbers) < FEWEST:
        return None
    numbers, quiet = (n[:: max(1, len(n) // most)] for n, most in ((numbers, FITTED), (quiet, FITTED // 4)))
    chosen = np.sort(np.concatenate([numbers, quiet]))
    subset = fitting.subset(chosen)
    surfaces, small = subset.surfaces, subset.change
    weight = np.sqrt(small.weight / small.weight.mean())[:, None]

    def error(theta: Array) -> Array:
        shown = small.shown(small.with_alpha(small.stored(surfaces.with_edit(edit_of(theta)))))
        differences = (shown - small.shown(small.found))[:, :3] * weight
        return np.asarray(np.nan_to_num(differences, nan=1e3, posinf=1e3, neginf=-1e3)).reshape(-1)

    sizes = [float(np.abs(error(start)).sum()) for start in starts]
    start = starts[int(np.argmin(sizes))]
    slopes = _slopes(error, start)
    if start.any():
        if min(sizes) >= float(np.abs(error(np.zeros_like(start))).sum()):
            return None
    elif _linear_share(error(start), slopes) < PROMISING:
        return None
    found = least_squares(error, start, partial(_slopes, error), loss="soft_l1", f_scale=SMOOTH, max_nfev=MOST_STEPS)
    return found.x, fitting.surfaces.with_edit(edit_of(found.x))


def _linear_share(errors: Array, slopes: Array) -> float:
    """Returns the share of errors (N,) that a fault of a linear effect explains. slopes: (N, P), the effect of its numbers."""
    best = np.linalg.lstsq(slopes, -errors, rcond=None)[0]
    return 1 - float(np.abs(errors + slopes @ best).sum()) / max(float(np.abs(errors).sum()), 1e-30)


def _slopes(function: Callable[[Array], Array], theta: Array) -> Array:
    """Returns the derivatives (N, P) of a function of P numbers, by differences.

    The step is so large because meshes are rounded to float32: least_squares' own steps would measure the rounding.
    """
    middle = function(theta)
    return np.stack([(function(theta + STEP * axis) - middle) / STEP for axis in np.eye(len(theta))], axis=1)
