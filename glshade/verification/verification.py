"""Verifier: a GPU's picture of a scene against what the float64 reference says that it may be. The rule: docs/tolerance.md."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from glshade import reference
from glshade.image.image import Image
from glshade.image.srgb import linear_to_srgb
from glshade.reference import LLVMPIPE, MARGIN, Bounds, Driver, Fragments, Inputs
from glshade.scene.scene import Rate, Scene
from glshade.verification.judgement import Comparison, Expected, PixelClass, classify, judge

Array = NDArray[Any]
Flags = NDArray[np.bool_]
Origin = Literal["coverage", "depth", "shading", "encode", "not finite", "-"]

# Silhouettes, ties and masked pixels may make up this share of the picture, ...
MAX_AMBIGUOUS = 0.03
# ... and this share of what is drawn: a speck on a large background is no proof.
MAX_DOUBTFUL = 0.5
WORST = 12


@dataclass(frozen=True)
class Pixel:
    """One pixel, for the table of the worst. low, high: the interval that came nearest; used: error over what is allowed."""

    x: int
    y: int
    object: str
    triangle: int
    kind: str
    value: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    error: float
    used: float
    origin: Origin


@dataclass(frozen=True, eq=False)
class Verdict:
    """What came of a verification. reasons: why it is not verified, one a line.

    error: the interior's; tolerance: the largest that was allowed there. picture, reference (H, W, C) float32, linear.
    """

    verdict: Literal["verified", "failed", "inconclusive"]
    reasons: tuple[str, ...]
    comparison: Comparison
    worst_pixels: tuple[Pixel, ...]
    picture: Array = field(repr=False)
    reference: Array = field(repr=False)
    classes: Array = field(repr=False)
    driver: str
    seconds: dict[str, float]

    @property
    def unexplained(self) -> int:
        """Pixels that no candidate explains."""
        return self.comparison.unexplained

    @property
    def ambiguous(self) -> float:
        """The picture's share of silhouettes, ties and masked pixels."""
        return self.comparison.ambiguous

    @property
    def exit_code(self) -> int:
        """0, 6 or 7: docs/exit-codes.md."""
        return {"verified": 0, "failed": 6, "inconclusive": 7}[self.verdict]

    def __str__(self) -> str:
        c = self.comparison
        counts = ", ".join(f"{number} {kind.name.lower()}" for kind, number in c.counts.items() if number)
        lines = [
            f"{self.verdict}: {c.unexplained} pixels unexplained, {self.ambiguous:.2%} ambiguous, "
            f"worst interior error {c.worst:.1e} (RMSE {c.rmse:.1e}, p99.9 {c.p999:.1e}; at most {share(self.used)} "
            "of what is allowed)",
            *self.reasons,
            counts,
        ]
        return "\n".join(lines)

    @property
    def used(self) -> float:
        """The most that any pixel uses of what is allowed to it."""
        return float(self.comparison.used.max(initial=0.0))

    def report(self, folder: Path, title: str = "picture") -> Path:
        """Writes the report: index.html with everything in it, and the pictures beside it. Returns the page."""
        from glshade.verification.report import Report, write

        c = self.comparison

        def colour(values: tuple[float, ...]) -> str:
            return " ".join(f"{value:.6g}" for value in values)

        facts = {
            "driver": self.driver,
            "unexplained": f"{c.unexplained} pixels",
            "not finite": f"{c.non_finite} values",
            "ambiguous": f"{c.ambiguous:.2%} of the picture, {c.doubtful:.2%} of what is drawn",
            "worst error": f"{c.worst:.2e} (interior and seams)",
            "RMSE": f"{c.rmse:.2e}",
            "p99.9": f"{c.p999:.2e}",
            "largest tolerance": f"{c.tolerance:.2e}",
            "most used": f"{share(self.used)} of a pixel's own tolerance",
            "time": ", ".join(f"{name} {seconds:.2f} s" for name, seconds in self.seconds.items()),
        }
        heads = ("x", "y", "object", "triangle", "class", "value", "least", "most", "error", "used", "arises in")
        rows = [
            [
                *(str(p.x), str(p.y), p.object, str(p.triangle) if p.triangle >= 0 else "", p.kind),
                *(colour(p.value), colour(p.low), colour(p.high)),
                *(f"{p.error:.1e}", share(p.used), p.origin),
            ]
            for p in self.worst_pixels
        ]
        return write(
            folder,
            Report(title, self.verdict, self.reasons, self.picture, self.reference, c, self.classes, facts, heads, rows),
        )

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        c = self.comparison
        return {
            "verdict": self.verdict,
            "reasons": list(self.reasons),
            "unexplained": c.unexplained,
            "non_finite": c.non_finite,
            "ambiguous": self.ambiguous,
            "counts": {kind.name.lower(): number for kind, number in c.counts.items()},
            "error": {"worst": c.worst, "rmse": c.rmse, "p99.9": c.p999, "tolerance": c.tolerance},
            "worst_pixels": [vars(pixel) for pixel in self.worst_pixels],
            "driver": self.driver,
            "seconds": self.seconds,
        }


def share(used: float) -> str:
    """A share in words: percent, or how many times over."""
    return f"{used:.0%}" if used < 10 else f"{used:.3g} times"


@dataclass(frozen=True, eq=False)
class Candidates:
    """Everything that the reference has to say of a scene: what `judge` wants, and who the candidates are.

    fragments, bounds: of Expected's candidates as long as `base` says; base (N,): -1 is the background behind blended layers.
    Fragments number the whole picture's pixels, everything else the crop's.
    """

    inputs: Inputs
    expected: Expected
    fragments: Fragments
    bounds: Bounds
    base: NDArray[np.intp]
    picture: Array


def candidates(scene: Scene, *, shading: Rate | None = None, driver: Driver = LLVMPIPE) -> Candidates:
    """What the float64 reference says that the picture may be. Errors: SceneError."""
    inputs = reference.prepare(scene, shading)
    width, height = inputs.size
    solid, layers, classes, open_, hidden = _classified(inputs, driver)
    found = reference.bounds(inputs, solid.fragments, driver)
    over = layers.take(layers.fragments.depth + layers.slack >= hidden[layers.fragments.pixel])
    over = over.take(np.lexsort((over.fragments.triangle, over.fragments.draw, over.fragments.pixel)))
    found_over = reference.bounds(inputs, over.fragments, driver)
    brightest = max((float(np.abs(b.value).max(initial=0.0)) for b in (found, found_over)), default=0.0)
    scale = min(1.0, brightest)
    low, high = found.interval(scale)
    pixel, base, centre = solid.fragments.pixel, np.arange(len(solid.fragments)), found.centre()
    if len(over.fragments):
        # Layers lie over surfaces, and over the background where it may be seen.
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
        _compose(pixel, low, high, centre, over.fragments, found_over, doubtful, scale)
        uncertain = np.unique(over.fragments.pixel[doubtful])
        sure = np.unique(over.fragments.pixel)
        classes[sure] = np.where(classes[sure] == PixelClass.BACKGROUND, PixelClass.INTERIOR, classes[sure])
        classes[uncertain] = PixelClass.SILHOUETTE
        open_[sure] = False
    picture = np.broadcast_to(inputs.background, (width * height, 4)).copy()
    first = np.flatnonzero(np.append(True, pixel[1:] != pixel[:-1])) if len(pixel) else np.empty(0, dtype=np.intp)
    picture[pixel[first]] = centre[first]
    wanted = inputs.wanted.reshape(-1)
    size = inputs.window[2:]
    expected = Expected(
        size, inputs.background, classes[wanted], open_[wanted], np.searchsorted(wanted, pixel), low, high, centre
    )
    return Candidates(inputs, expected, solid.fragments, found, base, picture[inputs.wanted])


def surfaces(scene: Scene, *, driver: Driver = LLVMPIPE) -> tuple[NDArray[np.intp], Flags]:
    """(object (H, W), certain (H, W)): which of the scene's objects is nearest, -1 for the background; where no driver could
    think otherwise. Errors: SceneError."""
    inputs = reference.prepare(single_sample(scene))
    width, height = inputs.size
    solid, layers, classes, _, _ = _classified(inputs, driver)
    found = np.full(width * height, -1, dtype=np.intp)
    # The farthest first, so that the nearest is what stays.
    order = np.argsort(solid.fragments.depth, kind="stable")
    numbers = np.array([draw.instance.number for draw in inputs.draws], dtype=np.intp)
    found[solid.fragments.pixel[order]] = numbers[solid.fragments.draw[order]]
    # Not seams: where two faces of a cube meet, either may be drawn.
    certain = np.isin(classes, (PixelClass.BACKGROUND, PixelClass.INTERIOR))
    certain[layers.fragments.pixel[layers.partial]] = False
    return found[inputs.wanted], certain[inputs.wanted]


def _classified(inputs: Inputs, driver: Driver) -> tuple[_Pieces, _Pieces, Array, Flags, Array]:
    """(opaque pieces by pixel, blended ones, classes, open, hidden): what may be seen, as `classify` has it."""
    width, height = inputs.size
    solid, layers = _seen(inputs, driver)
    kept, classes, open_, hidden = classify(
        width * height, solid.fragments.pixel, solid.fragments.depth, solid.slack, solid.partial, solid.sealed
    )
    solid = solid.take(kept)
    return solid.take(np.argsort(solid.fragments.pixel, kind="stable")), layers, classes, open_, hidden


def verify(
    scene: Scene,
    *,
    backend: Any = "auto",
    device: int | None = None,
    shading: Rate | None = None,
    max_ambiguous: float = MAX_AMBIGUOUS,
    picture: Any = None,
    renderer: Any = None,
    mask: Flags | None = None,
    driver: Driver | None = None,
) -> Verdict:
    """Whether the GPU's picture of the scene, linear and with one sample a pixel, is right, pixel by pixel.

    picture: (H, W, 3 or 4), judged in place of the GPU's. renderer: a Renderer to draw with, in place of a new one on backend
    and device. mask (H, W): pixels to leave out; they count as ambiguous. max_ambiguous: the budget's share. driver: what is
    known of its fixed functions; left out: by GL_RENDERER.
    Errors: SceneError, ShaderError, ContextError, GlshadeError where picture has another size.
    """
    from time import perf_counter

    scene = single_sample(scene)
    start = perf_counter()
    made_by = ""
    if picture is None:
        picture, made_by = _drawn(scene, shading, renderer, backend, device)
    drawn = perf_counter()
    expected = candidates(scene, shading=shading, driver=driver or reference.driver_of(made_by))
    judged = perf_counter()
    result = verdict_of(np.asarray(getattr(picture, "pixels", picture)), expected, mask, max_ambiguous, made_by)
    result.seconds.update({"draw": drawn - start, "reference": judged - drawn, "judge": perf_counter() - judged})
    return result


def single_sample(scene: Scene) -> Scene:
    """The scene with one sample a pixel, kept in float32: what the reference speaks of."""
    film = scene.film.model_copy(update={"samples": 1, "supersample": 1})
    return scene.model_copy(update={"film": film, "quality": scene.quality.model_copy(update={"storage": None})})


def verdict_of(
    picture: Array,
    expected: Candidates,
    mask: Flags | None = None,
    max_ambiguous: float = MAX_AMBIGUOUS,
    made_by: str = "",
    *,
    explain: bool = True,
) -> Verdict:
    """Judges a picture (H, W, 3 or 4). explain: look for where errors arise, too. Errors: GlshadeError."""
    comparison = judge(picture, expected.expected, mask)
    reasons = []
    if comparison.non_finite:
        reasons.append(f"{comparison.non_finite} value{'s are' if comparison.non_finite > 1 else ' is'} not finite")
    if comparison.unexplained:
        number = comparison.unexplained
        reasons.append(f"{number} pixel{'s are' if number > 1 else ' is'} outside every interval that the reference allows")
    if comparison.empty and not comparison.may_be_empty:
        reasons.append("the picture is empty, and the scene is not")
    verdict: Literal["verified", "failed", "inconclusive"] = "failed" if reasons else "verified"
    if not reasons and comparison.ambiguous > max_ambiguous:
        verdict = "inconclusive"
        reasons.append(f"{comparison.ambiguous:.2%} of the picture is ambiguous, more than {max_ambiguous:.2%}")
    elif not reasons and comparison.doubtful > MAX_DOUBTFUL:
        verdict = "inconclusive"
        reasons.append(f"{comparison.doubtful:.0%} of what is drawn is ambiguous, more than {MAX_DOUBTFUL:.0%}")
    channels = picture.shape[2]
    return Verdict(
        verdict,
        tuple(reasons),
        comparison,
        tuple(_worst(picture, expected, comparison)) if explain else (),
        picture,
        expected.picture[..., :channels].astype(np.float32),
        np.where(mask, PixelClass.MASKED, _map(expected)) if mask is not None else _map(expected),
        made_by or "picture given",
        {},
    )


def _map(expected: Candidates) -> Array:
    width, height = expected.expected.size
    return expected.expected.classes.reshape(height, width)


def _drawn(scene: Scene, shading: Rate | None, renderer: Any, backend: Any, device: int | None) -> tuple[Array, str]:
    from glshade.gl.renderer import Renderer

    if renderer is None:
        with Renderer(backend, device) as renderer:
            return _drawn(scene, shading, renderer, backend, device)
    image: Image = renderer.render(scene, dtype="float32", shading=shading)
    # A copy: the renderer's own array is used again for the next picture.
    return image.pixels.copy(), f"{renderer.context.renderer}; {renderer.context.version}"


@dataclass(frozen=True, eq=False)
class _Pieces:
    """Fragments with what is to be known of them: slack of depth, partial, sealed."""

    fragments: Fragments
    slack: Array
    partial: Flags
    sealed: Flags

    def take(self, which: Any) -> _Pieces:
        return _Pieces(self.fragments.take(which), self.slack[which], self.partial[which], self.sealed[which])


def _seen(inputs: Inputs, driver: Driver) -> tuple[_Pieces, _Pieces]:
    """(opaque, blended) fragments that may be seen; farther ones are dropped on the way, so that memory holds few."""
    width, height = inputs.size
    hidden = np.full(width * height, -np.inf)
    modes = np.array([draw.alpha_mode for draw in inputs.draws])
    parts: dict[bool, list[tuple[Fragments, Array]]] = {False: [], True: []}
    for part in reference.rasterise(inputs, MARGIN):
        # Nearer than the near plane and farther than the far one nothing is drawn; at them a driver may decide either way.
        part = part.take(part.depth + 1e-6 >= hidden[part.pixel])
        slack = reference.depth_slack(inputs, part, driver)
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


def _settled(inputs: Inputs, fragments: Fragments, slack: Array, driver: Driver) -> _Pieces:
    """Cut-outs are decided where they can be; partial fragments join where they leave no gap."""
    cutoff = np.array([draw.alpha_cutoff if draw.alpha_mode == "mask" else -np.inf for draw in inputs.draws])
    masked = np.flatnonzero(cutoff[fragments.draw] > -np.inf)
    uncertain = np.zeros(len(fragments), dtype=np.bool_)
    if len(masked):
        _, low, high = reference.alphas(inputs, fragments.take(masked), driver)
        limit = cutoff[fragments.draw[masked]]
        uncertain[masked] = low < limit
        there = np.ones(len(fragments), dtype=np.bool_)
        there[masked] = high >= limit
        fragments, slack, uncertain = fragments.take(there), slack[there], uncertain[there]
    partial = fragments.partial | uncertain
    sealed = np.zeros(len(fragments), dtype=np.bool_)
    which = np.flatnonzero(fragments.partial & ~uncertain)
    if not len(which):
        return _Pieces(fragments, slack, partial, sealed)
    sealed[which] = reference.sealed(inputs, fragments.take(which))
    pieces = _Pieces(fragments, slack, partial, sealed)
    turned = which[reference.turnable(inputs, fragments.take(which))]
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
    """Lays the blended layers, ordered by pixel and place, over the candidates at `pixel`, in place. Interval arithmetic."""
    layer_low, layer_high = bounds.interval(scale)
    layer_centre = bounds.centre()
    start = np.flatnonzero(np.append(True, layers.pixel[1:] != layers.pixel[:-1]))
    level = np.arange(len(layers)) - np.repeat(start, np.diff(np.append(start, len(layers))))
    for number in range(int(level.max(initial=-1)) + 1):
        which = np.flatnonzero(level == number)
        at = np.searchsorted(layers.pixel[which], pixel)
        hit = np.flatnonzero(layers.pixel[which][np.minimum(at, len(which) - 1)] == pixel)
        of = which[at[hit]]
        through = [1 - bounds.alpha_high[of, None], 1 - bounds.alpha_low[of, None]]
        ends = [share * end[hit] for share in through for end in (low, high)]
        over_low, over_high = layer_low[of] + np.minimum.reduce(ends), layer_high[of] + np.maximum.reduce(ends)
        slack = 8 * 2.0**-24 * np.maximum(np.abs(over_low), np.abs(over_high))
        over_low, over_high = over_low - slack, over_high + slack
        maybe = doubtful[of, None]
        low[hit] = np.where(maybe, np.minimum(over_low, low[hit]), over_low)
        high[hit] = np.where(maybe, np.maximum(over_high, high[hit]), over_high)
        covered = (layers.covered[of])[:, None]
        over = layer_centre[of] + (1 - layer_centre[of, 3:]) * centre[hit]
        centre[hit] = np.clip(np.where(covered, over, centre[hit]), low[hit], high[hit])


def _worst(picture: Array, expected: Candidates, comparison: Comparison) -> list[Pixel]:
    """The unexplained pixels that are farthest off; after them those that use most of what is allowed."""
    width, _ = expected.expected.size
    excess, used = comparison.excess.reshape(-1), comparison.used.reshape(-1)
    number = min(WORST, len(excess))
    key = np.where(excess > 0, 1e300, used) if not excess.any() else np.where(excess > 0, 10 + excess, 0) + np.minimum(used, 1)
    key = np.nan_to_num(key, posinf=1e308)
    chosen = np.argpartition(-key, number - 1)[:number]
    chosen = chosen[np.argsort(-key[chosen], kind="stable")]
    chosen = chosen[key[chosen] > 0]
    hidden = _hidden(expected, [int(index) for index in chosen if excess[index] > 0])
    result = []
    channels = picture.shape[2]
    for index in chosen:
        nearest = int(comparison.candidate[index])
        base = int(expected.base[nearest]) if nearest >= 0 else -1
        owner, triangle = "background", -1
        if base >= 0:
            draw = expected.inputs.draws[int(expected.fragments.draw[base])]
            owner, triangle = draw.instance.name, int(expected.fragments.triangle[base])
        value = picture.reshape(-1, channels)[index]
        low, high = (
            (part[nearest, :channels] if nearest >= 0 else expected.expected.background[:channels])
            for part in (expected.expected.low, expected.expected.high)
        )
        result.append(
            Pixel(
                x=int(index % width),
                y=int(index // width),
                object=owner,
                triangle=triangle,
                kind=PixelClass(int(_map(expected).reshape(-1)[index])).name.lower(),
                value=tuple(map(float, value)),
                low=tuple(map(float, low)),
                high=tuple(map(float, high)),
                error=float(comparison.error.reshape(-1)[index]),
                used=float(used[index]),
                origin=_origin(value, expected, nearest, hidden.get(int(index))) if excess[index] > 0 else "-",
            )
        )
    return result


def _origin(value: Array, expected: Candidates, nearest: int, hidden: tuple[Array, Array] | None) -> Origin:
    """What an unexplained value looks like. hidden: intervals (K, 4) of all that lies at the pixel, seen or not."""
    if not np.isfinite(value).all():
        return "not finite"
    channels = len(value)
    background = expected.expected.background[:channels]
    if nearest < 0 or np.abs(value - background).max() <= 1e-6 * max(1.0, np.abs(background).max()):
        # Something where nothing is, or nothing where something is.
        return "coverage"
    if hidden is not None:
        low, high = (end[:, :channels] for end in hidden)
        if ((value >= low) & (value <= high)).all(axis=1).any():
            return "depth"
    centre = expected.expected.centre[nearest, :3]
    room = (expected.expected.high - expected.expected.low)[nearest, :3].max() + 1 / 255
    return "encode" if np.abs(value[:3] - linear_to_srgb(centre)).max() <= room else "shading"


def _hidden(expected: Candidates, pixels: list[int]) -> dict[int, tuple[Array, Array]]:
    """pixel -> (low, high) (K, 4) of every fragment there, hidden ones too."""
    if not pixels:
        return {}
    inputs = expected.inputs
    numbers = inputs.wanted.reshape(-1)[pixels]
    parts = (part.take(np.isin(part.pixel, numbers)) for part in reference.rasterise(inputs, MARGIN))
    fragments = Fragments.joined(parts)
    found = reference.bounds(inputs, fragments)
    low, high = found.interval(min(1.0, float(np.abs(found.value).max(initial=0.0))))
    return {
        pixel: (low[fragments.pixel == number], high[fragments.pixel == number])
        for pixel, number in zip(pixels, numbers, strict=True)
    }
