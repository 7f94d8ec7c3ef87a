"""Pairs: two layers of the same size and channels, and the pixels in which they differ."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.golden.result import Metrics
from glshade.image.srgb import linear_to_srgb

Array = NDArray[Any]


@dataclass(frozen=True, eq=False)
class Pair:
    """A layer of the reference file and the same layer of the test file.

    Most pictures of a pair are nearly the same, so rules look only at the K pixels that differ.

    name: the layer's name; empty for the picture itself.
    channels: the names of the C channels, without the layer's name, such as R.
    reference, test: (H, W, C) uint8 or float32, row 0 at the top.
    """

    name: str
    channels: tuple[str, ...]
    reference: Array
    test: Array

    @property
    def size(self) -> int:
        """The number of pixels."""
        return int(self.reference.shape[0] * self.reference.shape[1])

    @property
    def finite(self) -> bool:
        """False where a value of either layer is infinite or NaN."""
        return all(values.dtype == np.uint8 or bool(np.isfinite(values).all()) for values in (self.reference, self.test))

    @property
    def holds_ids(self) -> bool:
        """True for a layer of numbers of objects or materials, by the names of the layer and its channels.

        These names are those with the word "id", such as object_id, those with "crypto", for Cryptomatte's layers, and the
        channel I of a layer.
        """
        names = [f"{self.name}.{channel}".lower() for channel in self.channels]
        return all("crypto" in name or "id" in re.split(r"[._: ]", name) or name[1:].endswith(".i") for name in names)

    @cached_property
    def changed(self) -> NDArray[np.bool_]:
        """(H, W), the pixels that differ; all of them where one layer holds 8-bit codes and the other one floats."""
        if self.reference.dtype != self.test.dtype:
            return np.ones(self.reference.shape[:2], dtype=np.bool_)
        return merged(np.logical_or, (self.reference[..., c] != self.test[..., c] for c in range(len(self.channels))))

    @cached_property
    def count(self) -> int:
        """K, the number of pixels that differ."""
        return int(np.count_nonzero(self.changed))

    @cached_property
    def changed_values(self) -> tuple[Array, Array]:
        """(K, C) each, the values of the reference and of the test where they differ."""
        return self.reference[self.changed], self.test[self.changed]

    @cached_property
    def errors(self) -> Array:
        """(K,) float64, the largest absolute difference of the channels; 8-bit codes count as code / 255."""
        reference, test = (
            values.astype(np.float64) / (255 if values.dtype == np.uint8 else 1) for values in self.changed_values
        )
        # The difference of two infinities is NaN.
        with np.errstate(invalid="ignore"):
            return merged(np.maximum, (np.abs(reference[:, c] - test[:, c]) for c in range(len(self.channels))))

    def metrics(self) -> Metrics:
        """Returns the sizes of the differences. All values must be finite."""
        if not self.count:
            return Metrics()
        reference, test = self.changed_values
        # The difference of two ids means nothing, so each pixel with another id counts as an error of 1.
        errors = np.ones(self.count) if self.holds_ids else self.errors
        codes = (reference, test) if self.holds_ids else (encoded(values, self.channels) for values in (reference, test))
        return Metrics(
            worst=float(errors.max()),
            rmse=float(np.sqrt(np.sum(errors**2) / self.size)),
            p999=_quantile(errors, self.size, 0.999),
            codes=int(np.count_nonzero(np.not_equal(*codes))),
        )


def _quantile(errors: Array, size: int, share: float) -> float:
    """Returns a quantile, interpolated between neighbours, of `size` numbers: these errors, and zeros.

    NumPy would take 10 ms for the zeros of a picture of 1024 x 1024 pixels.
    """
    # Position 0 is the largest number.
    position = (size - 1) * (1 - share)
    first = int(position)
    largest = np.sort(np.partition(errors, -min(first + 2, len(errors)))[-(first + 2) :])[::-1]
    upper, lower = (float(largest[index]) if index < len(largest) else 0.0 for index in (first, first + 1))
    return upper + (lower - upper) * (position - first)


def encoded(values: Array, channels: tuple[str, ...]) -> Array:
    """Returns values (..., C) as 8-bit codes: uint8 as they are, floats sRGB-encoded as int16, and alpha without encoding.

    A negative value has the negative code of its amount, so that two of them never look the same because both were clipped.
    """
    if values.dtype == np.uint8:
        return values
    codes = np.sign(values) * np.rint(255 * linear_to_srgb(np.abs(values)))
    for index, name in enumerate(channels):
        if name == "A":
            codes[..., index] = np.rint(255 * np.clip(values[..., index], -1, 1))
    return codes.astype(np.int16)


def merged(function: np.ufunc, channels: Iterable[Array]) -> Array:
    """Returns the channels, arrays of the same shape, combined into one. NumPy reduces a short last axis much more slowly."""
    first, *others = channels
    for channel in others:
        function(first, channel, out=first)
    return first
