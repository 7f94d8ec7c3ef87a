"""Texturing: pictures read at texture coordinates, trilinear. OpenGL 4.6 core, 8.14."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.textures.mipmap import levels
from glshade.textures.texels import Texels
from glshade.textures.texture import WrapMode

Array = NDArray[Any]


@dataclass(frozen=True, eq=False)
class Sampler:
    """A mip chain in one piece. texels (sum of H W, 4) float32; starts, widths, heights (L,): of the levels in it. span: how
    often the unit of texture coordinates goes into the texels, along u and v."""

    texels: NDArray[np.float32]
    starts: NDArray[np.intp]
    widths: NDArray[np.intp]
    heights: NDArray[np.intp]
    wrap: tuple[WrapMode, WrapMode]
    span: tuple[int, int] = (1, 1)

    @classmethod
    def load(cls, given: Texels) -> Sampler:
        """What is uploaded. Errors: AssetError."""
        return cls._of(given.read(), given.wrap, given.span)

    @classmethod
    def of(cls, pixels: NDArray[np.float32], wrap: tuple[WrapMode, WrapMode]) -> Sampler:
        """A picture (H, W, 4), row 0 at the top; v = 0 is its bottom."""
        return cls._of(np.ascontiguousarray(pixels[::-1]), wrap, (1, 1))

    @classmethod
    def _of(cls, pixels: NDArray[np.float32], wrap: tuple[WrapMode, WrapMode], span: tuple[int, int]) -> Sampler:
        chain = list(levels(pixels))
        heights, widths = (np.array([level.shape[axis] for level in chain]) for axis in (0, 1))
        starts = np.concatenate([[0], np.cumsum(heights * widths)[:-1]])
        return cls(np.concatenate([level.reshape(-1, 4) for level in chain]), starts, widths, heights, wrap, span)

    @property
    def size(self) -> NDArray[np.float64]:
        """(2,): texels of the largest level to a unit of texture coordinates, u and v."""
        result: NDArray[np.float64] = np.array([self.widths[0], self.heights[0]]) / np.array(self.span)
        return result

    def level(self, dx: Array, dy: Array) -> Array:
        """lambda (N,): the level of detail where uv changes by dx and dy (N, 2) from pixel to pixel; eqs. 8.8 and 8.10."""
        size = self.size.astype(dx.dtype)
        longest = np.maximum(np.linalg.norm(dx * size, axis=1), np.linalg.norm(dy * size, axis=1))
        # 1e-30 texels a pixel: far below level 0, and the logarithm stays finite.
        result: Array = np.log2(np.maximum(longest, 1e-30))
        return result

    def sample(self, uv: Array, level: Array | None = None) -> Array:
        """(N, 4) at uv (N, 2), at the levels of detail (N,); without, as in the vertex stage, at level 0."""
        base = np.zeros(len(uv), dtype=np.intp)
        if level is None:
            return self._bilinear(uv, base)
        last = len(self.starts) - 1
        level = np.clip(level, 0.0, last)
        lower = np.minimum(level.astype(np.intp), last)
        t = (level - lower)[:, None]
        result = self._bilinear(uv, lower)
        between = np.flatnonzero(t[:, 0] > 0)
        upper = self._bilinear(uv[between], lower[between] + 1)
        result[between] = result[between] * (1 - t[between]) + upper * t[between]
        return result

    def _bilinear(self, uv: Array, level: NDArray[np.intp]) -> Array:
        start, width, height = self.starts[level], self.widths[level], self.heights[level]
        u, v = uv[:, 0] / self.span[0] * width - 0.5, uv[:, 1] / self.span[1] * height - 0.5
        left, below = np.floor(u), np.floor(v)
        s, t = (u - left)[:, None], (v - below)[:, None]
        columns = [_wrapped(left.astype(np.intp) + k, width, self.wrap[0]) for k in (0, 1)]
        rows = [_wrapped(below.astype(np.intp) + k, height, self.wrap[1]) * width + start for k in (0, 1)]
        lower, upper = (
            self.texels[row + columns[0]].astype(uv.dtype) * (1 - s) + self.texels[row + columns[1]].astype(uv.dtype) * s
            for row in rows
        )
        result: Array = lower * (1 - t) + upper * t
        return result


def _wrapped(index: NDArray[np.intp], size: NDArray[np.intp], mode: WrapMode) -> NDArray[np.intp]:
    """Texel numbers within [0, size): table 8.20."""
    if mode == "clamp":
        return np.clip(index, 0, size - 1)
    if mode == "repeat":
        wrapped: NDArray[np.intp] = index % size
        return wrapped
    # There and back again: the second half of a period of 2 size runs backward.
    index = index % (2 * size)
    there_and_back: NDArray[np.intp] = np.minimum(index, 2 * size - 1 - index)
    return there_and_back
