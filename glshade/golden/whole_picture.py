"""Whole picture: faults that treat all pixels alike, such as a picture that is encoded twice, turned or shifted."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import permutations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.golden.change import ALIKE, ENOUGH, FEW, NAMED, Change, change_of
from glshade.golden.result import Cause, Stage
from glshade.image.srgb import linear_to_srgb, srgb_to_linear

Array = NDArray[Any]
Flags = NDArray[np.bool_]

NAMES = "rgba"
# The side of the part of the picture in which a shift is looked for, and the least side [pixels].
WINDOW, SMALLEST = 256, 8
# The longest shift that is looked for [share of the part's side], and the number of likely shifts that are tried.
FARTHEST, LIKELY = 0.25, 3
# The pixels that a fitted factor is found from must be at least this bright [share of white], and not white.
DARK, WHITE = 0.02, 0.995
# Numbers of bits of the coarser codes that are tried.
BITS = range(1, 8)


@dataclass(frozen=True, eq=False)
class Fault:
    """A fault, and the picture that it would give.

    kind, text, stage: as in `Cause`.
    model: (K, C), the values at the sample of a Change, in the unit of the file; NaN where the fault leaves them open.
    """

    kind: str
    text: str
    stage: Stage
    model: Array


def faults(change: Change) -> Iterator[Fault]:
    """Yields faults of the whole picture, the simplest ones first. It depends on the picture which of them are tried."""
    for source in (_constant, _moved, _exchanged, _lost, _encoded, _alpha, _shifted, _scaled, _coarse):
        yield from source(change)


def _constant(change: Change) -> Iterator[Fault]:
    """Yields the fault that the wrong picture has one colour everywhere."""
    found = change.found
    if (found == found[0]).all() and (change.true != change.true[0]).any():
        black = not found[0, : change.colours].any()
        text = "whole picture black" if black else "whole picture of one colour: nothing was drawn"
        yield Fault("empty", text, "coverage", found.copy())


def _moved(change: Change) -> Iterator[Fault]:
    """Yields the mirror images and turns of the picture."""
    width, height = change.size
    y, x = np.divmod(change.pixel, width)
    places: list[tuple[str, str, Array, Array]] = [
        ("flip", "whole picture flipped upside down", height - 1 - y, x),
        ("flip", "whole picture mirrored left to right", y, width - 1 - x),
        ("turn", "whole picture turned by 180 degrees", height - 1 - y, width - 1 - x),
    ]
    if width == height:
        places += [
            ("turn", "whole picture turned by 90 degrees clockwise", width - 1 - x, y),
            ("turn", "whole picture turned by 90 degrees counter-clockwise", x, width - 1 - y),
            ("turn", "whole picture with rows and columns exchanged", x, y),
        ]
    for kind, text, row, column in places:
        yield Fault(kind, text, "encode", change.values(change.truth, row * width + column))


def _exchanged(change: Change) -> Iterator[Fault]:
    """Yields the pictures with their colour channels in another order."""
    if change.colours != 3:
        return
    for order in permutations(range(3)):
        if order == (0, 1, 2):
            continue
        model = change.true.copy()
        model[:, :3] = change.true[:, order]
        fixed = [c for c in range(3) if order[c] == c]
        swapped = [NAMES[c] for c in range(3) if c not in fixed]
        text = (
            f"channels {', '.join(swapped)} exchanged"
            if fixed
            else f"channels r, g, b hold {', '.join(NAMES[c] for c in order)}"
        )
        yield Fault("exchange", text, "encode", model)


def _lost(change: Change) -> Iterator[Fault]:
    """Yields the pictures that lack a channel, or all colour."""
    for channel in range(change.colours):
        value = change.found[0, channel]
        if (change.found[:, channel] == value).all():
            model = change.true.copy()
            model[:, channel] = value
            yield Fault("channel", f"channel {NAMES[channel]} is {value:.3g} everywhere", "encode", model)
    if change.colours == 3:
        # Weights of red, green and blue: Rec. 709, Rec. 601, and the mean.
        for weights in ((0.2126, 0.7152, 0.0722), (0.299, 0.587, 0.114), (1 / 3, 1 / 3, 1 / 3)):
            for model in _greys(change, np.array(weights)):
                yield Fault("channel", "colours lost: the picture is grey", "encode", model)


def _greys(change: Change, weights: Array) -> Iterator[Array]:
    """Yields the picture (K, C) in grey, from its numbers and from its linear light. weights: (3,), of red, green and blue."""
    for colours in (change.true[:, :3] @ weights, change.stored(change.linear(change.true[:, :3]) @ weights)):
        yield change.with_alpha(np.repeat(colours[:, None], 3, axis=1))


def _encoded(change: Change) -> Iterator[Fault]:
    """Yields the pictures whose colours went through the sRGB curve once too often or once too seldom, or the wrong way."""
    curves: tuple[tuple[str, Callable[[Array], Array]], ...] = (
        (
            "whole picture encoded twice" if change.coded else "whole picture sRGB-encoded, although its numbers are linear",
            linear_to_srgb,
        ),
        ("whole picture not encoded" if change.coded else "whole picture decoded once too often", srgb_to_linear),
        ("colours inverted", lambda c: 1 - c),
    )
    for text, curve in curves:
        model = change.true.copy()
        model[:, : change.colours] = curve(np.clip(change.true[:, : change.colours], 0, None))
        yield Fault("encode", text, "encode", model)


def _alpha(change: Change) -> Iterator[Fault]:
    """Yields the pictures whose alpha is lost, or multiplies the colours once too often or once too seldom."""
    if not change.alpha:
        return
    true, n = change.true, change.colours
    alpha = true[:, n:]
    for value in (1.0, 0.0):
        model = true.copy()
        model[:, n:] = value
        yield Fault("alpha", f"alpha lost: it is {value:.0f} everywhere", "encode", model)
    for text, colours in (
        ("colours multiplied by alpha once too often", true[:, :n] * alpha),
        ("colours not multiplied by alpha", np.divide(true[:, :n], alpha, out=np.zeros_like(true[:, :n]), where=alpha > 0)),
    ):
        yield Fault("alpha", text, "encode", np.concatenate([colours, alpha], axis=1))
    inverted = true.copy()
    inverted[:, n:] = 1 - alpha
    yield Fault("alpha", "alpha inverted", "encode", inverted)


def _shifted(change: Change) -> Iterator[Fault]:
    """Yields the picture moved by the whole number of pixels at which it fits best.

    The picture's parts that come from beyond its border count as undetermined. The shift is found by phase correlation (Kuglin
    and Hines 1975).
    """
    width, height = change.size
    y, x = np.divmod(change.pixel, width)
    for right, down in _offsets(change):
        row, column = y - down, x - right
        inside = (row >= 0) & (row < height) & (column >= 0) & (column < width)
        model = change.values(change.truth, np.where(inside, row * width + column, 0))
        model[~inside] = np.nan
        yield Fault("shift", f"whole picture shifted by ({right}, {down})", "coverage", model)


def _offsets(change: Change) -> list[tuple[int, int]]:
    """Returns the shifts (right, down) [pixels] to try: the shortest ones, and those that are most likely; never (0, 0).

    The likely ones are found in a part of the picture round the pixels that changed.
    """
    width, height = change.size
    rows, columns = np.divmod(change.pixel[change.amount > 0], width)
    if not len(rows):
        return []
    box = tuple(_range(round(float(np.median(at))), side) for at, side in ((rows, height), (columns, width)))
    shape = len(box[0]), len(box[1])
    if min(shape) < SMALLEST:
        return []
    numbers = (np.array(box[0])[:, None] * width + np.array(box[1])).reshape(-1)
    grey = (change.shown(change.values(p, numbers)).sum(axis=1).reshape(shape) for p in (change.truth, change.test))
    # The border of the part does not move with the picture. A window fades it out (Hann), or it would hide a shift.
    window = np.outer(*(np.hanning(side + 2)[1:-1] for side in shape))
    truth, test = (np.fft.rfft2((values - values.mean()) * window) for values in grey)
    cross = test * np.conj(truth)
    peaks = np.fft.irfft2(cross / np.maximum(np.abs(cross), 1e-9), s=shape)
    peaks[0, 0] = -np.inf
    # The shortest shifts are the most common ones, and smooth pictures have no sharp peak.
    found = [(right, down) for down in (-1, 0, 1) for right in (-1, 0, 1) if right or down]
    for index in np.argsort(peaks, axis=None)[: -LIKELY - 1 : -1]:
        place = divmod(int(index), shape[1])
        down, right = (at - side if at > side // 2 else at for at, side in zip(place, shape, strict=True))
        if abs(down) <= FARTHEST * shape[0] and abs(right) <= FARTHEST * shape[1]:
            found.append((right, down))
    return found


def _range(middle: int, side: int) -> range:
    """Returns at most WINDOW rows or columns round a middle, inside of a picture with this many."""
    length = min(side, WINDOW)
    start = min(max(middle - length // 2, 0), side - length)
    return range(start, start + length)


def _scaled(change: Change) -> Iterator[Fault]:
    """Yields the pictures with another exposure, gamma or brightness, as far as one number describes it."""
    n = change.colours
    true, found = change.true[:, :n], change.found[:, :n]
    usable = (np.abs(change.shown(change.true)[:, :n]) > DARK) & (found > 0)
    if change.coded:
        usable &= (true < WHITE) & (found < WHITE)
    if usable.sum() < 8:
        return
    rest = change.true[:, n:]
    light, seen = change.linear(true), change.linear(found)
    factor = float(np.median(seen[usable] / light[usable]))
    yield Fault("exposure", f"exposure x {factor:.2f}", "encode", np.concatenate([change.stored(light * factor), rest], axis=1))
    mid = usable & (true < WHITE) & (found < WHITE)
    if mid.sum() >= 8:
        power = float(np.median(np.log(found[mid]) / np.log(true[mid])))
        if power > 0:
            model = np.concatenate([np.maximum(true, 0) ** power, rest], axis=1)
            yield Fault("gamma", f"gamma of the whole picture x {1 / power:.2f}", "encode", model)
    offset = float(np.median((found - true)[usable]))
    unit = f"{offset * 255:+.0f} codes" if change.coded else f"{offset:+.3g}"
    yield Fault("brightness", f"every value {unit}", "encode", np.concatenate([true + offset, rest], axis=1))


def _coarse(change: Change) -> Iterator[Fault]:
    """Yields the 8-bit pictures with fewer levels, which shows as bands."""
    if not change.coded:
        return
    if len(np.unique(change.found[:, : change.colours])) > 1 << max(BITS):
        return
    for bits in BITS:
        steps = (1 << bits) - 1
        for text, model in (
            ("rounded", np.rint(change.true * steps) / steps),
            ("cut off", np.floor(change.true * 255 / (256 >> bits)) * (256 >> bits) / 255),
        ):
            model[:, change.colours :] = change.true[:, change.colours :]
            yield Fault("banding", f"banding: colours {text} to {bits} bits", "encode", model)


def whole_picture_causes(truth: Array, test: Array, alpha: bool, changed: Flags) -> tuple[Cause, ...]:
    """Returns the fault of the whole picture that explains a change; nothing where none does.

    truth, test: (H, W, C) uint8 or float32, finite, of the same type.
    alpha: whether the last channel is alpha.
    changed: (H, W), the pixels that differ.
    """
    count = int(np.count_nonzero(changed))
    if count <= FEW:
        return ()
    best = best_fault(change_of(truth, test, alpha, changed))
    return (replace(best, pixels=count),) if best is not None else ()


def best_fault(change: Change) -> Cause | None:
    """Returns the first fault of the whole picture that explains about as much as the best one; None if all explain little."""
    best: Cause | None = None
    for fault in faults(change):
        with np.errstate(all="ignore"):
            share = change.explained(fault.model)
        if share >= NAMED and (best is None or share > best.explained + ALIKE):
            best = Cause(fault.kind, fault.text, stage=fault.stage, explained=share)
            if share >= ENOUGH:
                break
    return best


def not_finite(pixels: Array) -> Cause:
    """Returns the cause that values of a picture (H, W, C) are infinite or NaN, with the place of the first one."""
    broken = ~np.isfinite(pixels)
    count = int(np.count_nonzero(broken))
    if count == broken.size:
        return Cause("not finite", "every value is infinite or NaN", pixels=broken[..., 0].size, explained=1.0)
    y, x, _ = np.argwhere(broken)[0]
    values = "1 value is" if count == 1 else f"{count} values are"
    pixels_broken = int(np.count_nonzero(broken.any(axis=2)))
    return Cause("not finite", f"{values} infinite or NaN, the first at x = {x}, y = {y}", pixels=pixels_broken, explained=1.0)
