"""Candidates: the values that the float64 reference allows each pixel of a picture to have.

A film with one sample a pixel is one picture. Supersampling, and more samples than a driver offers at once, average several
pictures that are shifted within the pixel; their intervals are averaged, too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.arrays import group_starts
from glshade.assembly.strokes import has_strokes
from glshade.glsl.shaders import Shaders
from glshade.reference.bounds import TINY, Bounds, fragment_bounds
from glshade.reference.freedom import LLVMPIPE, Freedom
from glshade.reference.inputs import Inputs, prepare
from glshade.reference.raster import Fragments
from glshade.scene.film import Film
from glshade.scene.object import Rate
from glshade.scene.scene import Scene
from glshade.verification.judgement import Expected, PixelClass
from glshade.verification.own_text import with_text
from glshade.verification.pieces import Pieces, Visible, visible

Array = NDArray[Any]
Flags = NDArray[np.bool_]
Indices = NDArray[np.intp]

# If a candidate's interval is wider than this share of the picture's brightest value, its pixel is not decided. Surfaces that
# meet in a pixel of several samples agree if the hull of their values is not wider than that.
WIDE = 0.1
# In a picture that is almost black, this share of the brightest light that arrives at a surface counts as the brightest value:
# what remains is the rounding error of light that cancels, or that only just reaches a surface.
DIM = 1e-3
# The roundings of a mean of up to 8 samples in float32, with a reserve. One rounding has a relative error of 2^-24 at most.
MEAN = 16 * 2.0**-24
# OpenGL 3.3 requires drivers to offer this many samples per pixel in one picture.
OFFERED = 4


@dataclass(frozen=True, eq=False)
class Candidates:
    """The values that the pixels of a picture may have, and the surfaces that these values come from.

    A candidate is one such value, with its bounds. A pixel has several candidates if a driver may show one of several surfaces.

    inputs: the scene, made ready for the reference.
    film: the film of the scene.
    expected: the N candidates in the form that `judge` takes.
    draw: (N,), the index into Inputs.draws of the surface that each candidate belongs to; -1 for the background.
    triangle: (N,), the row of that draw's triangles; -1 for the background.
    picture: (H, W, 4), the reference's picture [linear, premultiplied]; uint8 for candidates of an 8-bit picture.
    straight: the least and the largest colours (N, 3) of the candidates without alpha [linear]; None if they follow from
        `expected`, because the background is opaque.
    driver: the freedom of the driver that the candidates are for.
    encoding: the encoding of an 8-bit picture (codes.py); empty for linear light.
    """

    inputs: Inputs
    film: Film
    expected: Expected
    draw: Indices
    triangle: Indices
    picture: Array
    straight: tuple[Array, Array] | None
    driver: Freedom
    encoding: str = ""

    def owner(self, candidate: int) -> tuple[str, int]:
        """Returns the name of a candidate's object, and its triangle; ("background", -1) for the background."""
        number = int(self.draw[candidate]) if candidate >= 0 else -1
        if number < 0:
            return "background", -1
        return self.inputs.draws[number].instance.name, int(self.triangle[candidate])

    @property
    def derived(self) -> bool:
        """Whether the GLSL of some object was run in place of its model's Python function."""
        return any(draw.text is not None for draw in self.inputs.draws)


def find_candidates(
    scene: Scene,
    *,
    shading: Rate | None = None,
    driver: Freedom = LLVMPIPE,
    derived: bool = False,
    shaders: Shaders | None = None,
) -> Candidates:
    """Returns the values that a picture of the scene may have, with the samples that its film asks for.

    shading: the shading rate for the whole scene; by default, each object has its own.
    driver: the freedom that the specification leaves to the driver.
    derived: True to run the GLSL of all objects in float64 in place of the models' Python functions. Without it, the GLSL is
        run for models that have no Python function.
    shaders: optional; the shader files whose GLSL is run. Default: those that ship with glshade.
    Errors: SceneError, ShaderError; NoReference for a model that has only its GLSL, where no compiler can read that.
    """
    film = scene.film
    values = prepare(scene, shading).decoded(driver.decoded, driver.decoding)
    inputs = with_text(scene, values, shading, derived, shaders)
    offsets = _offsets(film, driver)
    if len(offsets) == 1:
        shown = _shown(inputs, _freedom(film, driver))
    else:
        shown = _averaged(inputs, offsets, driver)
    wanted = inputs.wanted.reshape(-1)
    # Outside of the window there are no fragments, so that all candidates lie inside.
    pixel = np.searchsorted(wanted, shown.pixel)
    expected = Expected(
        inputs.window[2:],
        inputs.background,
        shown.classes[wanted],
        shown.open[wanted],
        pixel,
        shown.low,
        shown.high,
        shown.centre,
        mixed=film.pictures > 1,
    )
    picture = np.broadcast_to(inputs.background, (len(wanted), 4)).copy()
    first = group_starts(pixel)
    picture[pixel[first]] = shown.centre[first]
    width, height = inputs.window[2:]
    picture = picture.reshape(height, width, 4)
    colours = None if inputs.background[3] == 1 else (shown.straight_low, shown.straight_high)
    return Candidates(inputs, film, expected, shown.draw, shown.triangle, picture, colours, driver)


def _offsets(film: Film, driver: Freedom) -> list[tuple[float, float]]:
    """Returns the offsets (right, down) of the pictures whose mean is the film's picture [pixels].

    They are those of the renderer (glshade/gl/tiles.py). A driver that is not known is taken to offer all samples at once.
    """
    if film.pictures == 1:
        return [(0.0, 0.0)]
    from glshade.gl.tiles import passes

    return passes(film, driver.samples or film.samples)


def _freedom(film: Film, driver: Freedom) -> Freedom:
    """Returns the freedom of a driver that may draw the film's samples in several pictures, shifted within the pixel."""
    if driver.samples or film.samples <= OFFERED:
        return driver
    # Two pictures of 4 samples are shifted by 1/16 pixel in both directions, and each is shaded at its own pixels' centres.
    return replace(driver, snap=driver.snap + 0.5 / film.samples)


def _cut_by_depth(pieces: Pieces, solid: Pieces, inputs: Inputs) -> Flags:
    """Returns whether each piece (N,) may have lost some of its samples to another surface of its pixel.

    That surface covers only some of them, or the two surfaces cross within the pixel. A driver may test the depth first, and
    then shade a triangle at the centroid of the samples that are left, although the triangle covers the whole pixel.
    """
    if not inputs.extent:
        return np.zeros(len(pieces.fragments), dtype=np.bool_)
    width, height = inputs.size
    cut: Flags = np.bincount(solid.fragments.pixel, minlength=width * height) > 1
    cut[solid.fragments.pixel[solid.anywhere]] = True
    return cut[pieces.fragments.pixel]


@dataclass(frozen=True, eq=False)
class _Shown:
    """The N candidates of a whole picture of P pixels, before any crop.

    classes: the PixelClass (P,) of each pixel.
    open: (P,), True where the background is accepted as well.
    pixel: (N,), ascending, the pixel of each candidate.
    low, high, centre: (N, 4) each, the two ends of each candidate's interval, and the reference's own value.
    straight_low, straight_high: (N, 3) each, the two ends of the colours without alpha.
    draw, triangle: (N,) each, as in Candidates.
    widest: the width of an interval up to which it determines its pixel's value [linear].
    """

    classes: NDArray[np.uint8]
    open: Flags
    pixel: Indices
    low: Array
    high: Array
    centre: Array
    straight_low: Array
    straight_high: Array
    draw: Indices
    triangle: Indices
    widest: float


def _shown(inputs: Inputs, driver: Freedom) -> _Shown:
    """Returns the candidates of one picture."""
    seen = visible(inputs, driver)
    classes, open_ = seen.classes.copy(), seen.open.copy()
    solid, over = seen.solid.fragments, seen.layers.fragments
    bounds, over_bounds = (
        fragment_bounds(inputs, pieces.fragments, driver, pieces.anywhere | _cut_by_depth(pieces, seen.solid, inputs))
        for pieces in (seen.solid, seen.layers)
    )
    brightest = max((float(np.abs(b.value).max(initial=0.0)) for b in (bounds, over_bounds)), default=0.0)
    arriving = max((float(b.arriving.max(initial=0.0)) for b in (bounds, over_bounds)), default=0.0)
    scale = min(1.0, brightest)
    # A scene without light is black, up to the smallest numbers of float32.
    widest = WIDE * max(brightest, DIM * arriving, 100 * TINY)
    low, high = bounds.interval(scale)
    pixel, centre = solid.pixel, bounds.centre()
    draw, triangle = solid.draw.astype(np.intp), solid.triangle.astype(np.intp)
    if inputs.extent:
        # A triangle that a driver cuts into several is shaded for each of them.
        classes[pixel[seen.solid.anywhere & (classes[pixel] == PixelClass.INTERIOR)]] = PixelClass.SEAM
        # Where no surface covers the pixel's centre, the reference's own picture shows the background there.
        centre[~solid.covered & open_[pixel]] = inputs.background
    else:
        agreed = _agreeing(len(classes), pixel, low, high, open_, inputs.background)
        classes[agreed & np.isin(classes, (PixelClass.SILHOUETTE, PixelClass.TIE))] = PixelClass.SEAM
    if len(over):
        # Blended layers lie over opaque surfaces. Where the background may be visible, they may also lie directly over it.
        bare = np.zeros(len(classes), dtype=np.bool_)
        bare[over.pixel] = True
        bare &= open_ | (classes == PixelClass.BACKGROUND)
        extra = np.flatnonzero(bare)
        background = np.broadcast_to(inputs.background, (len(extra), 4))
        order = np.argsort(np.concatenate([pixel, extra]), kind="stable")
        pixel = np.concatenate([pixel, extra])[order]
        draw, triangle = (np.concatenate([part, np.full(len(extra), -1)])[order] for part in (draw, triangle))
        low, high, centre = (np.concatenate([part, background])[order] for part in (low, high, centre))
        doubtful = _doubtful(seen)
        _compose(pixel, low, high, centre, over, over_bounds, doubtful, scale)
        uncertain, layered = np.unique(over.pixel[doubtful]), np.unique(over.pixel)
        background_alone = classes[layered] == PixelClass.BACKGROUND
        classes[layered] = np.where(background_alone, PixelClass.INTERIOR, classes[layered])
        classes[uncertain] = PixelClass.SILHOUETTE
        # The candidates of these pixels include the bare background already.
        open_[layered] = False
    shown = _Shown(classes, open_, pixel, low, high, centre, *straight(low, high), draw, triangle, widest)
    if inputs.extent:
        shown = _merged(shown, inputs.background)
    wide = np.zeros(len(classes), dtype=np.bool_)
    wide[shown.pixel[(shown.high - shown.low > widest).any(axis=1)]] = True
    if any(draw.text is not None for draw in inputs.draws):
        shown = _undetermined(inputs, shown, wide)
    shown.classes[wide & (shown.classes != PixelClass.EDGE)] = PixelClass.WIDE
    return shown


def _undetermined(inputs: Inputs, shown: _Shown, wide: Flags) -> _Shown:
    """Returns the candidates with intervals without ends where float32 does not determine the value of a text.

    A few runs with random rounding tell how far a driver may err, except where the text has a pole: there, few results are far
    off, but very far. So the pixels beside a wide one are not determined either.
    wide: (P,), the wide pixels; those beside them are added where a text was run.
    """
    width, height = inputs.size
    of_text = np.array([draw.text is not None for draw in inputs.draws] + [False])
    run = np.zeros(len(wide), dtype=np.bool_)
    # The last entry stands for the background, whose number is -1.
    run[shown.pixel[of_text[shown.draw]]] = True
    around = _with_neighbours((wide & run).reshape(height, width)).reshape(-1) & run
    wide |= around
    free = around[shown.pixel, None]
    return replace(shown, low=np.where(free, -np.inf, shown.low), high=np.where(free, np.inf, shown.high))


def _with_neighbours(flags: Flags) -> Flags:
    """Returns whether each pixel (H, W), or one of the eight pixels round it, has its flag set."""
    padded = np.pad(flags, 1)
    rows = padded[:-2] | padded[1:-1] | padded[2:]
    result: Flags = rows[:, :-2] | rows[:, 1:-1] | rows[:, 2:]
    return result


def _doubtful(seen: Visible) -> Flags:
    """Returns whether a driver may leave out each blended fragment at one of its pixel's samples."""
    nearest = np.full(len(seen.classes), -np.inf)
    np.maximum.at(nearest, seen.solid.fragments.pixel, seen.solid.depths.nearest)
    return seen.layers.partial | (seen.layers.depths.farthest <= nearest[seen.layers.fragments.pixel])


def _merged(shown: _Shown, background: Array) -> _Shown:
    """Returns the candidates of a picture with one for each pixel: the hull of all that the pixel's samples may show.

    The mean of several samples lies in the hull of their values, channel by channel.
    background: (4,).
    """
    start = group_starts(shown.pixel)
    if not len(start):
        return shown
    pixel = shown.pixel[start]
    low, high = np.minimum.reduceat(shown.low, start), np.maximum.reduceat(shown.high, start)
    bare = shown.open[pixel, None]
    low, high = np.where(bare, np.minimum(low, background), low), np.where(bare, np.maximum(high, background), high)
    # The colour of a mean without its alpha is a mean, weighted with alpha, of the samples' colours without theirs.
    (behind,), _ = straight(background[None], background[None])
    colours = np.minimum.reduceat(shown.straight_low, start), np.maximum.reduceat(shown.straight_high, start)
    agreed = (high - low <= shown.widest).all(axis=1)
    classes = shown.classes.copy()
    mixed = ~np.isin(classes[pixel], (PixelClass.INTERIOR, PixelClass.WIDE))
    classes[pixel[mixed]] = np.where(agreed, PixelClass.SEAM, PixelClass.EDGE)[mixed]
    rounding = MEAN * np.maximum(np.abs(low), np.abs(high))
    return replace(
        shown,
        classes=classes,
        open=np.zeros_like(shown.open),
        pixel=pixel,
        low=low - rounding,
        high=high + rounding,
        centre=np.clip(shown.centre[start], low, high),
        straight_low=np.where(bare, np.minimum(colours[0], behind), colours[0]),
        straight_high=np.where(bare, np.maximum(colours[1], behind), colours[1]),
        draw=shown.draw[start],
        triangle=shown.triangle[start],
    )


def _averaged(inputs: Inputs, offsets: list[tuple[float, float]], driver: Freedom) -> _Shown:
    """Returns the candidates of the mean of several pictures, which are shifted within the pixel: one for each pixel.

    The mean of values lies in the mean of their intervals. The pictures are taken one after the other, so that only one of them
    is in memory.
    offsets: the offsets (right, down) of the pictures [pixels].
    """
    count = inputs.size[0] * inputs.size[1]
    low, high, centre = (np.zeros((count, 4)) for _ in range(3))
    (behind,), _ = straight(inputs.background[None], inputs.background[None])
    colours = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    draw, triangle = np.full(count, -1), np.full(count, -1)
    bare, interior, wide = np.ones(count, dtype=np.bool_), np.ones(count, dtype=np.bool_), np.zeros(count, dtype=np.bool_)
    widest = 0.0
    for right, down in offsets:
        shifted = inputs.shifted(right, down)
        shown = _shown(shifted, driver)
        shown = shown if inputs.extent else _merged(shown, inputs.background)
        for total, part in ((low, shown.low), (high, shown.high), (centre, shown.centre)):
            total += inputs.background
            total[shown.pixel] += part - inputs.background
        shows = np.zeros(count, dtype=np.bool_)
        shows[shown.pixel] = True
        for bound, ends, part in ((np.minimum, colours[0], shown.straight_low), (np.maximum, colours[1], shown.straight_high)):
            ends[~shows] = bound(ends[~shows], behind)
            ends[shown.pixel] = bound(ends[shown.pixel], part)
        new = draw[shown.pixel] < 0
        draw[shown.pixel[new]], triangle[shown.pixel[new]] = shown.draw[new], shown.triangle[new]
        bare &= shown.classes == PixelClass.BACKGROUND
        interior &= shown.classes == PixelClass.INTERIOR
        wide |= shown.classes == PixelClass.WIDE
        widest = max(widest, shown.widest)
    for total in (low, high, centre):
        total /= len(offsets)
    rounding = MEAN * np.maximum(np.abs(low), np.abs(high))
    low, high = low - rounding, high + rounding
    classes = np.where((high - low <= widest).all(axis=1), PixelClass.SEAM, PixelClass.EDGE).astype(np.uint8)
    for kind, flags in ((PixelClass.INTERIOR, interior), (PixelClass.WIDE, wide), (PixelClass.BACKGROUND, bare)):
        classes[flags] = kind
    pixel = np.flatnonzero(~bare)
    return _Shown(
        classes,
        np.zeros(count, dtype=np.bool_),
        pixel,
        low[pixel],
        high[pixel],
        centre[pixel],
        colours[0][pixel],
        colours[1][pixel],
        draw[pixel],
        triangle[pixel],
        widest,
    )


def straight(low: Array, high: Array) -> tuple[Array, Array]:
    """Returns the least and the largest colours (N, 3) without alpha for intervals of premultiplied colours.

    A colour without any alpha is 0.
    low, high: the two ends (N, 4) of the intervals [linear, premultiplied].
    """
    least, largest = np.maximum(low[:, 3:], 0), high[:, 3:]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        ends = [
            np.where(alpha > 0, colour / alpha, np.where(colour > 0, np.inf, 0.0))
            for colour in (low[:, :3], high[:, :3])
            for alpha in (least, largest)
        ]
    clear = least <= 0
    lowest, highest = np.minimum(ends[0], ends[1]), np.maximum(ends[2], ends[3])
    return np.where(clear, np.minimum(lowest, 0.0), lowest), np.where(clear, np.maximum(highest, 0.0), highest)


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
    inputs = prepare(one_sample(scene))
    width, height = inputs.size
    seen = visible(inputs, driver)
    fragments, layers = seen.solid.fragments, seen.layers
    nearest = np.full(width * height, -1, dtype=np.intp)
    # The fragments are assigned from the farthest to the nearest, so that the nearest one overwrites the others.
    order = np.argsort(fragments.depth, kind="stable")
    numbers = np.array([draw.instance.number for draw in inputs.draws], dtype=np.intp)
    nearest[fragments.pixel[order]] = numbers[fragments.draw[order]]
    # Seams are not certain: where two objects share an edge, a driver may draw either.
    certain = np.isin(seen.classes, (PixelClass.BACKGROUND, PixelClass.INTERIOR))
    certain[layers.fragments.pixel[layers.partial]] = False
    return nearest[inputs.wanted], certain[inputs.wanted]


def judgeable(scene: Scene) -> Scene:
    """Returns the scene stored as float32 and shaded exactly, which is what the reference has bounds for."""
    exact = {"normalise": None, "arithmetic": None}
    objects = tuple(
        item.model_copy(update={"quality": item.quality.model_copy(update=exact)}) if item.quality else item
        for item in scene.objects
    )
    quality = scene.quality.model_copy(update={"storage": None, **exact})
    return scene.model_copy(update={"objects": objects, "quality": quality})


def one_sample(scene: Scene) -> Scene:
    """Returns the scene with one sample a pixel, and otherwise as `judgeable` does."""
    film = scene.film.model_copy(update={"samples": 1, "supersample": 1})
    return judgeable(scene.model_copy(update={"film": film}))


def at_centres(scene: Scene) -> tuple[Scene, tuple[str, ...]]:
    """Returns a scene with points or lines with one sample a pixel, and the settings that this takes away. Any other scene is
    returned as it is.

    A pixel at an edge has a mixture of values, for which there are wide bounds alone. Points and lines of a few pixels consist
    of edges, so they are judged at the centres of the pixels.
    """
    film = scene.film
    if film.pictures == 1 or not has_strokes(scene):
        return scene, ()
    changed = {key: getattr(film, key) for key in ("samples", "supersample") if getattr(film, key) > 1}
    single = film.model_copy(update=dict.fromkeys(changed, 1))
    settings = tuple(f"film.{key} = {value}" for key, value in changed.items())
    return scene.model_copy(update={"film": single}), settings


def left_out(scene: Scene) -> tuple[str, ...]:
    """Returns the settings of a scene that `judgeable` takes away, each as "name = value", because they are not judged."""
    quality = scene.quality
    qualities = [quality, *(item.quality for item in scene.objects if item.quality)]
    settings = [
        (quality.storage is not None, f"quality.storage = {quality.storage}"),
        (any(q.normalise is False for q in qualities), "quality.normalise = false"),
        (any(q.arithmetic == "fast" for q in qualities), "quality.arithmetic = fast"),
    ]
    return tuple(text for is_set, text in settings if is_set)


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
