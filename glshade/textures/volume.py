"""Volume: a table of colours over three coordinates, which both renderers read with trilinear filtering."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

# How a table continues beyond its ends: with its last texel, or from its other end.
End = Literal["clamp", "repeat"]


@dataclass(frozen=True, eq=False)
class Volume:
    """A table of W x H x D texels, which are half floats on the CPU as on the GPU.

    texels: the colours (D, H, W, 3) float16.
    ends: how the table continues along its width, height and depth.
    digest: a text that differs between different tables.
    shift: optional, added to the places along width, height and depth at which the table is read [texels]. It stands for a
        driver that computes the weights of the texels less precisely.
    """

    texels: NDArray[np.float16]
    ends: tuple[End, End, End]
    digest: str
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @classmethod
    def constant(cls, value: float) -> Volume:
        """Returns a table of one texel."""
        return cls(np.full((1, 1, 1, 3), value, np.float16), ("clamp", "clamp", "clamp"), f"constant {value!r}")

    @property
    def size(self) -> tuple[int, int, int]:
        """Width, height and depth [texels]."""
        depth, height, width, _ = self.texels.shape
        return width, height, depth

    def sample(self, at: Array) -> Array:
        """Returns the filtered colours (..., 3), in the type of the coordinates (OpenGL 4.6 core, section 8.14.2).

        at: texture coordinates (..., 3); from 0 to 1 they span the table.
        """
        dtype = at.dtype
        result: Array = np.zeros(at.shape, dtype)
        (x, x_share), (y, y_share), (z, z_share) = (self._along(axis, at[..., axis]) for axis in range(3))
        for column, across in zip(x, _weights(x_share), strict=True):
            for row, up in zip(y, _weights(y_share), strict=True):
                for layer, deep in zip(z, _weights(z_share), strict=True):
                    result += self.texels[layer, row, column].astype(dtype) * (across * up * deep)[..., None]
        return result

    def _along(self, axis: int, at: Array) -> tuple[tuple[NDArray[np.intp], NDArray[np.intp]], Array]:
        """Returns the indices of the two texels beside each coordinate (...), and the weight (...) of the second one."""
        count = self.size[axis]
        place = at * at.dtype.type(count) + at.dtype.type(self.shift[axis] - 0.5)
        below = np.floor(place)
        share, first = place - below, below.astype(np.intp)
        if self.ends[axis] == "repeat":
            return (first % count, (first + 1) % count), share
        return (np.clip(first, 0, count - 1), np.clip(first + 1, 0, count - 1)), share


def _weights(share: Array) -> tuple[Array, Array]:
    """Returns the weights of two neighbouring texels, of which the second one has the weight `share`."""
    return 1 - share, share
