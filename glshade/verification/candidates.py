"""Candidates: the values that the float64 reference allows each pixel of a picture to have."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.arrays import group_starts
from glshade.reference.bounds import TINY, Bounds, alphas, fragment_bounds
from glshade.reference.freedom import LLVMPIPE, Freedom
from glshade.reference.inputs import Inputs, prepare
from glshade.reference.planes import depth_slack, may_turn
from glshade.reference.raster import MARGIN, Fragments, rasterise
from glshade.reference.sealing import is_sealed
from glshade.scene.object import Rate
from glshade.scene.scene import Scene
from glshade.verification.judgement import Expected, PixelClass, classify

Array = NDArray[Any]
Flags = NDArray[np.bool_]

# If a candidate's interval is wider than this share of the picture's brightest value, its pixel is not decided.
WIDE = 0.1
# In a picture that is almost black, this share of the brightest light that arrives at a surface counts as the brightest value:
# what remains is the rounding error of light that cancels, or that only just reaches a surface.
DIM = 1e-3


@dataclass(frozen=True, eq=False)
class Candidates:
    """The values that the pixels of a picture may have, and the surfaces that these values come from.

    A candidate is one such value, with its bounds. A pixel has several candidates if a driver may show one of several surfaces.

    inputs: the scene, made ready for the reference.
    expected: the N candidates in the form that `judge` takes.
    fragments: the M fragments of opaque surfaces, sorted by pixel. Their pixel numbers count the pixels of the whole picture,
        while all other pixel numbers count the pixels of the crop.
    bounds: the bounds of the values of the M fragments.
    base: (N,), the index of the opaque fragment that each candidate belongs to; -1 for a candidate of blended layers directly
        over the background.
    picture: (H, W, 4), the reference's picture [linear, premultiplied].
    """

    inputs: Inputs
    expected: Expected
    fragments: Fragments
    bounds: Bounds
    base: NDArray[np.intp]
    picture: Array


def find_candidates(scene: Scene, *, shading: Rate | None = None, driver: Freedom = LLVMPIPE) -> Candidates:
    """Returns the values that a picture of the scene may have.

    shading: the shading rate for the whole scene; by default, each object has its own.
    driver: the freedom that the specification leaves to the driver.
    Errors: SceneError.
    """
    inputs = prepare(scene, shading)
    width, height = inputs.size
    solid, layers, classes, open_, hidden = _classified(inputs, driver)
    bounds = fragment_bounds(inputs, solid.fragments, driver)
    over = layers.take(layers.fragments.depth + layers.slack >= hidden[layers.fragments.pixel])
    over = over.take(np.lexsort((over.fragments.triangle, over.fragments.draw, over.fragments.pixel)))
    over_bounds = fragment_bounds(inputs, over.fragments, driver)
    brightest = max((float(np.abs(b.value).max(initial=0.0)) for b in (bounds, over_bounds)), default=0.0)
    scale = min(1.0, brightest)
    low, high = bounds.interval(scale)
    pixel, base, centre = solid.fragments.pixel, np.arange(len(solid.fragments)), bounds.centre()
    agreed = _agreeing(width * height, pixel, low, high, open_, inputs.background)
    classes[agreed & np.isin(classes, (PixelClass.SILHOUETTE, PixelClass.TIE))] = PixelClass.SEAM
    if len(over.fragments):
        # Blended layers lie over opaque surfaces. Where the background may be visible, they may also lie directly over it.
        bare = np.zeros(width * height, dtype=np.bool_)
        bare[over.fragments.pixel] = True
        bare &= open_ | (classes == PixelClass.BACKGROUND)
        extra = np.flatnonzero(bare)
        background = np.broadcast_to(inputs.background, (len(extra), 4))
        order = np.argsort(np.concatenate([pixel, extra]), kind="stable")
        pixel = np.concatenate([pixel, extra])[order]
        base = np.concatenate([base, np.full(len(extra), -1)])[order]
        low, high, centre = (np.concatenate([part, background])[order] for part in (low, high, centre))
        nearest = np.full(width * height, -np.inf)
        np.maximum.at(nearest, solid.fragments.pixel, solid.fragments.depth + solid.slack)
        doubtful = over.partial | (over.fragments.depth - over.slack <= nearest[over.fragments.pixel])
        _compose(pixel, low, high, centre, over.fragments, over_bounds, doubtful, scale)
        uncertain = np.unique(over.fragments.pixel[doubtful])
        layered = np.unique(over.fragments.pixel)
        background_alone = classes[layered] == PixelClass.BACKGROUND
        classes[layered] = np.where(background_alone, PixelClass.INTERIOR, classes[layered])
        classes[uncertain] = PixelClass.SILHOUETTE
        # The candidates of these pixels include the bare background already.
        open_[layered] = False
    arriving = max((float(b.arriving.max(initial=0.0)) for b in (bounds, over_bounds)), default=0.0)
    # A scene without light is black, up to the smallest numbers of float32.
    widest = WIDE * max(brightest, DIM * arriving, 100 * TINY)
    classes[pixel[(high - low > widest).any(axis=1)]] = PixelClass.WIDE
    picture = np.broadcast_to(inputs.background, (width * height, 4)).copy()
    first = group_starts(pixel)
    picture[pixel[first]] = centre[first]
    wanted = inputs.wanted.reshape(-1)
    size = inputs.window[2:]
    expected = Expected(
        size, inputs.background, classes[wanted], open_[wanted], np.searchsorted(wanted, pixel), low, high, centre
    )
    return Candidates(inputs, expected, solid.fragments, bounds, base, picture[inputs.wanted])


def _agreeing(size: int, pixel: Array, low: Array, high: Array, open_: Flags, background: Array) -> Flags:
    """Returns whether all values that each pixel (size,) may have agree within their tolerance: then any of them may be shown.

    They agree if all their intervals together are at most twice as wide as the widest of them, in every channel. In a dense
    mesh many triangles meet in a pixel, and all have almost the same light.
    pixel: the pixel (N,) of each candidate, ascending.
    low, high: the intervals (N, 4) of the candidates.
    open_: whether (size,) the background may be visible.
    background: (4,).
    """
    agreed = np.zeros(size, dtype=np.bool_)
    start = group_starts(pixel)
    if len(start):
        shown = pixel[start]
        least, largest = np.minimum.reduceat(low, start), np.maximum.reduceat(high, start)
        bare = open_[shown, None]
        least = np.where(bare, np.minimum(least, background), least)
        largest = np.where(bare, np.maximum(largest, background), largest)
        agreed[shown] = (largest - least <= 2 * np.maximum.reduceat(high - low, start)).all(axis=1)
    return agreed


def surfaces(scene: Scene, *, driver: Freedom = LLVMPIPE) -> tuple[NDArray[np.intp], Flags]:
    """Returns (object (H, W), certain (H, W)) of a picture of the scene with one sample a pixel.

    object: the number of the nearest object in the scene, -1 for the background.
    certain: True where every driver must show the nearest object.
    Errors: SceneError.
    """
    inputs = prepare(single_sample(scene))
    width, height = inputs.size
    solid, layers, classes, _, _ = _classified(inputs, driver)
    nearest = np.full(width * height, -1, dtype=np.intp)
    # The fragments are assigned from the farthest to the nearest, so that the nearest one overwrites the others.
    order = np.argsort(solid.fragments.depth, kind="stable")
    numbers = np.array([draw.instance.number for draw in inputs.draws], dtype=np.intp)
    nearest[solid.fragments.pixel[order]] = numbers[solid.fragments.draw[order]]
    # Seams are not certain: where two objects share an edge, a driver may draw either.
    certain = np.isin(classes, (PixelClass.BACKGROUND, PixelClass.INTERIOR))
    certain[layers.fragments.pixel[layers.partial]] = False
    return nearest[inputs.wanted], certain[inputs.wanted]


def _classified(inputs: Inputs, driver: Freedom) -> tuple[_Pieces, _Pieces, Array, Flags, Array]:
    """Returns (opaque, blended, classes, open, hidden) of a whole picture of P pixels, before any crop.

    opaque: the fragments of opaque surfaces that may be visible, sorted by pixel, as pieces.
    blended: the fragments of blended surfaces that may be visible, as pieces.
    classes, open, hidden: (P,) each, as `classify` returns them.
    """
    width, height = inputs.size
    solid, layers = _visible(inputs, driver)
    kept, classes, open_, hidden = classify(
        width * height, solid.fragments.pixel, solid.fragments.depth, solid.slack, solid.partial, solid.sealed
    )
    solid = solid.take(kept)
    return solid.take(np.argsort(solid.fragments.pixel, kind="stable")), layers, classes, open_, hidden


def single_sample(scene: Scene) -> Scene:
    """Returns the scene with one sample a pixel, stored as float32, shaded exactly: what the reference has bounds for."""
    film = scene.film.model_copy(update={"samples": 1, "supersample": 1})
    exact = {"normalise": None, "arithmetic": None}
    objects = tuple(
        item.model_copy(update={"quality": item.quality.model_copy(update=exact)}) if item.quality else item
        for item in scene.objects
    )
    quality = scene.quality.model_copy(update={"storage": None, **exact})
    return scene.model_copy(update={"film": film, "objects": objects, "quality": quality})


def left_out(scene: Scene) -> tuple[str, ...]:
    """Returns the settings of a scene that `single_sample` takes away, each as "name = value", because they are not judged."""
    film, quality = scene.film, scene.quality
    qualities = [quality, *(item.quality for item in scene.objects if item.quality)]
    settings = [
        (film.samples > 1, f"film.samples = {film.samples}"),
        (film.supersample > 1, f"film.supersample = {film.supersample}"),
        (quality.storage is not None, f"quality.storage = {quality.storage}"),
        (any(q.normalise is False for q in qualities), "quality.normalise = false"),
        (any(q.arithmetic == "fast" for q in qualities), "quality.arithmetic = fast"),
    ]
    return tuple(text for is_set, text in settings if is_set)


@dataclass(frozen=True, eq=False)
class _Pieces:
    """N fragments, and the freedom that a driver has in drawing each of them.

    fragments: the N fragments.
    slack: (N,), the largest difference between the driver's depth and the reference's.
    partial: (N,), True where a driver may leave the fragment out.
    sealed: (N,), True for a partial fragment if it and others together certainly cover the pixel.
    """

    fragments: Fragments
    slack: Array
    partial: Flags
    sealed: Flags

    def take(self, which: Any) -> _Pieces:
        """Returns the pieces that an index array or a mask selects."""
        return _Pieces(self.fragments.take(which), self.slack[which], self.partial[which], self.sealed[which])


def _visible(inputs: Inputs, driver: Freedom) -> tuple[_Pieces, _Pieces]:
    """Returns (opaque, blended): the pieces that may be visible. Hidden pieces are dropped early to save memory."""
    width, height = inputs.size
    hidden = np.full(width * height, -np.inf)
    modes = np.array([draw.alpha_mode for draw in inputs.draws])
    parts: dict[bool, list[tuple[Fragments, Array]]] = {False: [], True: []}
    for part in rasterise(inputs, MARGIN):
        # A cheap first test with a fixed depth margin drops most hidden fragments before their slack is computed.
        part = part.take(part.depth + 1e-6 >= hidden[part.pixel])
        slack = depth_slack(inputs, part, driver)
        # Fragments in front of the near plane or behind the far plane are not drawn. If a fragment is nearer to a plane than
        # its slack, a driver may draw it or not.
        inside = (part.depth + slack >= 0) & (part.depth - slack <= 1)
        clipped = (part.depth - slack <= 0) | (part.depth + slack >= 1)
        possible = inside & (part.depth + slack >= hidden[part.pixel])
        part = replace(part, partial=part.partial | clipped).take(possible)
        slack = slack[possible]
        opaque = (modes[part.draw] == "opaque") & ~part.partial
        np.maximum.at(hidden, part.pixel[opaque], (part.depth - slack)[opaque])
        blended = modes[part.draw] == "blend"
        for kind in (False, True):
            which = np.flatnonzero(blended == kind)
            if len(which):
                parts[kind].append((part.take(which), slack[which]))
    pieces = []
    for kind in (False, True):
        fragments = Fragments.joined(part for part, _ in parts[kind])
        slack = np.concatenate([slack for _, slack in parts[kind]]) if parts[kind] else np.empty(0)
        near = fragments.depth + slack >= hidden[fragments.pixel]
        pieces.append(_settled(inputs, fragments.take(near), slack[near], driver))
    return pieces[0], pieces[1]


def _settled(inputs: Inputs, fragments: Fragments, slack: Array, driver: Freedom) -> _Pieces:
    """Returns the fragments (N,) as pieces.

    Fragments that the alpha test certainly discards are dropped. Fragments that it may discard become partial. Some triangles
    are so thin that a driver may see either side: their fragments are listed twice, once for each side.
    slack: (N,), as in _Pieces.
    """
    cutoff = np.array([draw.alpha_cutoff if draw.alpha_mode == "mask" else -np.inf for draw in inputs.draws])
    masked = np.flatnonzero(cutoff[fragments.draw] > -np.inf)
    uncertain = np.zeros(len(fragments), dtype=np.bool_)
    if len(masked):
        _, low, high = alphas(inputs, fragments.take(masked), driver)
        limit = cutoff[fragments.draw[masked]]
        uncertain[masked] = low < limit
        kept = np.ones(len(fragments), dtype=np.bool_)
        kept[masked] = high >= limit
        fragments, slack, uncertain = fragments.take(kept), slack[kept], uncertain[kept]
    partial = fragments.partial | uncertain
    sealed = np.zeros(len(fragments), dtype=np.bool_)
    which = np.flatnonzero(fragments.partial & ~uncertain)
    if not len(which):
        return _Pieces(fragments, slack, partial, sealed)
    sealed[which] = is_sealed(inputs, fragments.take(which), driver)
    pieces = _Pieces(fragments, slack, partial, sealed)
    turned = which[may_turn(inputs, fragments.take(which), driver)]
    if not len(turned):
        return pieces
    other = replace(fragments.take(turned), front=~fragments.front[turned])
    return _Pieces(
        Fragments.joined([fragments, other]),
        np.concatenate([slack, slack[turned]]),
        np.concatenate([partial, partial[turned]]),
        np.concatenate([sealed, sealed[turned]]),
    )


def _compose(
    pixel: Array,
    low: Array,
    high: Array,
    centre: Array,
    layers: Fragments,
    bounds: Bounds,
    doubtful: Flags,
    scale: float,
) -> None:
    """Blends the layers of blended surfaces over N candidates by interval arithmetic. Changes low, high and centre in place.

    pixel: (N,), ascending, the pixel of each candidate.
    low, high, centre: (N, 4) each, the two ends and the middle of each candidate's interval.
    layers: the M fragments of blended surfaces, sorted by pixel and within a pixel from the first drawn to the last.
    bounds: the bounds of the values of the M fragments.
    doubtful: (M,), True for a fragment that a driver may leave out.
    scale: the picture's brightest value, at most 1 [linear].
    """
    layer_low, layer_high = bounds.interval(scale)
    layer_centre = bounds.centre()
    start = group_starts(layers.pixel)
    level = np.arange(len(layers)) - np.repeat(start, np.diff(np.append(start, len(layers))))
    for number in range(int(level.max(initial=-1)) + 1):
        which = np.flatnonzero(level == number)
        at = np.searchsorted(layers.pixel[which], pixel)
        hit = np.flatnonzero(layers.pixel[which][np.minimum(at, len(which) - 1)] == pixel)
        layer = which[at[hit]]
        through = [1 - bounds.alpha_high[layer, None], 1 - bounds.alpha_low[layer, None]]
        ends = [share * end[hit] for share in through for end in (low, high)]
        over_low, over_high = layer_low[layer] + np.minimum.reduce(ends), layer_high[layer] + np.maximum.reduce(ends)
        # Blending rounds a few times. One rounding in float32 has a relative error of 2^-24 at most; 8 times that is ample.
        slack = 8 * 2.0**-24 * np.maximum(np.abs(over_low), np.abs(over_high))
        over_low, over_high = over_low - slack, over_high + slack
        maybe = doubtful[layer, None]
        low[hit] = np.where(maybe, np.minimum(over_low, low[hit]), over_low)
        high[hit] = np.where(maybe, np.maximum(over_high, high[hit]), over_high)
        covered = layers.covered[layer][:, None]
        over = layer_centre[layer] + (1 - layer_centre[layer, 3:]) * centre[hit]
        centre[hit] = np.clip(np.where(covered, over, centre[hit]), low[hit], high[hit])
