"""Change: how a wrong picture differs from the true one at a sample of their pixels, and how well a fault explains it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.image.srgb import linear_to_srgb, srgb_to_linear

Array = NDArray[Any]
Flags = NDArray[np.bool_]
Indices = NDArray[np.intp]

# The share of the change that a fault must explain to be named, and the share above which no other fault is looked for.
NAMED, ENOUGH = 0.9, 0.99
# Of two faults whose shares differ by less than this, the simpler one is named.
ALIKE = 0.01
# No fault is looked for where this many pixels are wrong or fewer, since nearly any fault would explain them.
FEW = 2
# The largest number of changed and of unchanged pixels that are looked at. More would not change which fault explains them.
CHANGED, UNCHANGED = 3000, 1000
# Differences up to this size do not count, in 8-bit pictures and in those of floats [share of white, as a screen shows it]:
# two roundings to the nearest code, and the rounding errors of drivers.
CODE, ROUNDING = 1.01 / 255, 3e-5
# The slope of the sRGB curve at white. Values beyond white are compared by their logarithms, with the same slope.
SLOPE = 1.055 / 2.4


def perceived(values: Array) -> Array:
    """Returns linear values of any shape as a screen shows them: sRGB-encoded up to 1, and beyond by their logarithm."""
    size = np.abs(values.astype(np.float64))
    # The curve is steep near 0, where float32 and float64 pictures must not differ by the rounding of `linear_to_srgb`.
    within = np.where(size > 0.0031308, 1.055 * np.maximum(np.minimum(size, 1.0), 0.0031308) ** (1 / 2.4) - 0.055, 12.92 * size)
    shown = np.where(size > 1, 1 + SLOPE * np.log(np.maximum(size, 1.0)), within)
    return np.asarray(np.sign(values) * shown)


@dataclass(frozen=True, eq=False)
class Change:
    """Two pictures, and a sample of K of their pixels.

    A picture's numbers are those of its file: 8-bit codes divided by 255, which are sRGB-encoded with straight alpha, or
    linear floats with premultiplied alpha.

    truth, test: (H, W, C) uint8 or float32, the right and the wrong picture, finite; C is 1 to 4.
    alpha: whether the last channel is alpha.
    pixel: (K,), the numbers of the sample's pixels, row * W + column, ascending.
    weight: (K,), the number of pixels that each pixel of the sample stands for.
    """

    truth: Array
    test: Array
    alpha: bool
    pixel: Indices
    weight: Array

    @property
    def coded(self) -> bool:
        """Whether the wrong picture holds 8-bit codes."""
        return bool(self.test.dtype == np.uint8)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the pictures [pixels]."""
        return self.test.shape[1], self.test.shape[0]

    @property
    def colours(self) -> int:
        """The number of channels that are not alpha."""
        return int(self.test.shape[2]) - self.alpha

    @cached_property
    def true(self) -> Array:
        """(K, C) float64, the right values in the unit of the file."""
        return self.values(self.truth, self.pixel)

    @cached_property
    def found(self) -> Array:
        """(K, C) float64, the wrong values in the unit of the file."""
        return self.values(self.test, self.pixel)

    def values(self, picture: Array, pixel: Indices) -> Array:
        """Returns the values (N, C) float64 of a picture at pixels (N,), in the unit of the file."""
        values = picture.reshape(-1, picture.shape[2])[pixel].astype(np.float64)
        return values / 255 if picture.dtype == np.uint8 else values

    def shown(self, values: Array) -> Array:
        """Returns values (N, C) in the unit of the file as a screen shows them. 8-bit values are clipped as in a file."""
        if self.coded:
            return np.clip(values, 0.0, 1.0)
        return np.concatenate([perceived(values[:, : self.colours]), values[:, self.colours :]], axis=1)

    def stored(self, linear: Array) -> Array:
        """Returns linear colours (N, 3) of opaque surfaces in the unit of the file."""
        return linear_to_srgb(linear).astype(np.float64) if self.coded else linear

    def with_alpha(self, colours: Array) -> Array:
        """Returns colours (K, 3) with the alpha that the picture should have, if it has one: (K, C)."""
        return np.concatenate([colours, self.true[:, self.colours :]], axis=1) if self.alpha else colours

    def linear(self, stored: Array) -> Array:
        """Returns colours (N, 3) in the unit of the file as linear light."""
        return srgb_to_linear(stored).astype(np.float64) if self.coded else stored

    @cached_property
    def floor(self) -> float:
        """The size up to which differences do not count, as a screen shows them."""
        return CODE if self.coded else ROUNDING

    @cached_property
    def amount(self) -> Array:
        """(K,), the size of each pixel's change beyond `floor`, times the pixel's weight."""
        return np.asarray(self.weight * self._beyond(self.shown(self.true)))

    def left(self, model: Array) -> Array:
        """Returns the size (K,) of the change that a model leaves unexplained, times the weights.

        model: (K, C), the values that a fault would give, in the unit of the file. NaN stands for a value that the fault does
            not determine; it leaves nothing.
        """
        return np.asarray(self.weight * np.nan_to_num(self._beyond(self.shown(model)), nan=0.0))

    def explained(self, model: Array, where: Flags | None = None) -> float:
        """Returns the share of the change that a model (K, C) explains: 1 for all of it, 0 or less for nothing.

        Where the model has NaN, the change does not count.
        where: optional (K,); only these pixels count.
        """
        counts = ~np.isnan(model).any(axis=1)
        if where is not None:
            counts &= where
        whole = float(self.amount[counts].sum())
        # A fault that leaves most of the change undetermined explains nothing.
        everything = float(self.amount.sum() if where is None else self.amount[where].sum())
        if whole <= 0 or whole < 0.5 * everything:
            return 0.0
        return 1 - float(self.left(model)[counts].sum()) / whole

    def _beyond(self, shown: Array) -> Array:
        """Returns how far (K,) shown values (K, C) lie from the wrong picture, in the worst channel, beyond `floor`."""
        return np.asarray(np.maximum(np.abs(shown - self._shown_test).max(axis=1) - self.floor, 0.0))

    @cached_property
    def _shown_test(self) -> Array:
        return self.shown(self.found)


def change_of(truth: Array, test: Array, alpha: bool, changed: Flags, within: Flags | None = None) -> Change:
    """Returns the change between two pictures (H, W, C), with a sample of the changed pixels (H, W) and of the others.

    The sample is the same for the same pictures.
    within: optional (H, W); the sample holds these pixels only.
    """
    flat = changed.reshape(-1)
    others = ~flat if within is None else ~flat & within.reshape(-1)
    random = np.random.default_rng(0)
    pixels, weights = [np.empty(0, dtype=np.intp)], [np.empty(0)]
    for numbers, most in ((np.flatnonzero(flat), CHANGED), (np.flatnonzero(others), UNCHANGED)):
        if len(numbers):
            chosen = numbers if len(numbers) <= most else random.choice(numbers, most, replace=False, shuffle=False)
            pixels.append(chosen)
            weights.append(np.full(len(chosen), len(numbers) / len(chosen)))
    pixel, weight = np.concatenate(pixels), np.concatenate(weights)
    order = np.argsort(pixel, kind="stable")
    return Change(truth, test, alpha, pixel[order], weight[order])
