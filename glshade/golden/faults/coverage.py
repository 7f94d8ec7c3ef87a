"""Coverage: objects that are missing, moved, or hide each other wrongly."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.golden.faults.fitting import FITTED, OBJECTS, Fitting, SceneFault, in_doubt, literal
from glshade.golden.surfaces import Surfaces
from glshade.reference.raster import rasterise, resolve
from glshade.reference.shade import is_there

Array = NDArray[Any]
Flags = NDArray[np.bool_]

# The number of objects whose movement is looked for, which takes 0.1 s each, and its largest size [pixels].
MOVED, FARTHEST = 2, 12


def covered(fitting: Fitting) -> Iterator[SceneFault]:
    """Yields the pictures in which objects are missing, or hide each other wrongly."""
    surfaces = fitting.surfaces
    every = surfaces.every
    for draw in fitting.objects:
        text = f"object {literal(surfaces.name(draw))} missing"
        yield SceneFault("object", text, "coverage", surfaces.nearest(every.draw != draw), alone=False)
    if len(every) == len(surfaces.shown):
        return
    anything = np.ones(len(every), dtype=np.bool_)
    # An object that is drawn in front of others changes their pixels and not its own.
    for draw in np.unique(every.draw)[:OBJECTS]:
        text = f"object {literal(surfaces.name(int(draw)))} in front of what hides it"
        in_front = surfaces.nearest(anything, every.depth + 2.0 * (every.draw == draw))
        yield SceneFault("depth", text, "depth", in_front, alone=False)
    farthest = surfaces.nearest(anything, -every.depth)
    yield SceneFault("depth", "the farthest surface is in front", "depth", farthest, alone=False)
    order = every.draw * (every.triangle.max() + 1.0) + every.triangle
    last = surfaces.nearest(anything, order)
    yield SceneFault("depth", "no depth test: the surface that is drawn last is in front", "depth", last, alone=False)


def objects_moved(fitting: Fitting) -> Iterator[SceneFault]:
    """Yields the pictures with one object moved by a whole number of pixels."""
    change, surfaces = fitting.change, fitting.surfaces
    width, height = change.size
    y, x = np.divmod(change.pixel, width)
    few = np.flatnonzero(fitting.counts)
    few = few[:: max(1, len(few) // FITTED)]
    small = replace(change, pixel=change.pixel[few], weight=change.weight[few])
    for draw in list(in_doubt(fitting))[:MOVED]:
        mask = _mask(surfaces, draw)
        without = change.stored(surfaces.nearest(surfaces.every.draw != draw))

        def moved(down: int, right: int, which: Any, mask: Flags = mask, without: Array = without) -> Array:
            source = np.clip(y[which] - down, 0, height - 1) * width + np.clip(x[which] - right, 0, width - 1)
            return np.where(mask[source][:, None], change.values(change.truth, source)[:, :3], without[which])

        steps = range(-FARTHEST, FARTHEST + 1)
        places = [(down, right) for down in steps for right in steps]
        down, right = max(places, key=lambda at: small.explained(small.with_alpha(moved(at[0], at[1], few))))
        text = f"object {literal(surfaces.name(draw))} moved by ({right}, {down}) pixels"
        yield SceneFault("object", text, "coverage", change.linear(moved(down, right, slice(None))), alone=False)


def _mask(surfaces: Surfaces, draw: int) -> Flags:
    """Returns which pixels (H * W,) of the picture show a draw, by one more pass of the reference."""
    inputs = surfaces.inputs
    shown, _ = resolve(inputs, rasterise(inputs), lambda fragments: is_there(inputs, fragments))
    whole = np.zeros(inputs.size[0] * inputs.size[1], dtype=np.bool_)
    whole[shown.pixel[shown.draw == draw]] = True
    return np.asarray(whole[inputs.wanted.reshape(-1)])
