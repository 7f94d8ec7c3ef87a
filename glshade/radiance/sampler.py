"""Sampler: textures that are read with trilinear filtering, as in section 8.14 of the OpenGL 4.6 core specification."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from glshade.arrays import rounded
from glshade.image.srgb import srgb_to_linear
from glshade.textures.storage import Float, Srgb8, Stored
from glshade.textures.texels import Texels
from glshade.textures.texture import UNPLACED, Filter, Placement, WrapMode

Array = NDArray[Any]

Rule = Literal["length", "largest", "sum"]
# Name of a rule -> the number of texels (N,) that a pixel spans by that rule, from the changes of the texel coordinates to the
# next pixel in the row and in the column (N, 2 each). Its logarithm is the level of detail. OpenGL 4.6 core, 8.14.1, defines
# "length" (equation 8.8), and allows a driver everything between "largest" and "sum" (equation 8.11).
RULES: Mapping[Rule, Callable[[Array, Array], Array]] = {
    "length": lambda dx, dy: np.maximum(np.linalg.norm(dx, axis=1), np.linalg.norm(dy, axis=1)),
    "largest": lambda dx, dy: np.maximum(np.abs(dx), np.abs(dy)).max(axis=1),
    "sum": lambda dx, dy: np.maximum(np.abs(dx), np.abs(dy)).sum(axis=1),
}


@dataclass(frozen=True, eq=False)
class Sampler:
    """A texture with its L mipmap levels in one array.

    texels: the texels of all levels (N, 4) float32, one level after the other, each from its bottom row to its top row.
    codes: the 8-bit sRGB codes (N, 3) from which a driver decodes the texels' colours; None for texels that are stored linear.
    starts: index of each level's first texel (L,).
    widths: width of each level (L,) [texels].
    heights: height of each level (L,) [texels].
    wrap: wrap modes along u and along v.
    span: how many units of texture coordinates a level spans, along u and along v.
    filter: how texels are filtered where the picture is magnified.
    placement: the rows (2, 3) of the matrix from a mesh's texture coordinates (u, v, 1) to the picture's, rounded to float32;
        None where the two are the same.
    decoding: the error with which a driver decodes the codes [codes].
    """

    texels: NDArray[np.float32]
    codes: NDArray[np.uint8] | None
    starts: NDArray[np.intp]
    widths: NDArray[np.intp]
    heights: NDArray[np.intp]
    wrap: tuple[WrapMode, WrapMode]
    span: tuple[int, int] = (1, 1)
    filter: Filter = "smooth"
    placement: Array | None = None
    decoding: float = 0.0

    @classmethod
    def load(cls, given: Texels) -> Sampler:
        """Returns the texture of a picture. Errors: AssetError."""
        return replace(cls._of(given.read(), given.wrap, given.span), filter=given.filter)

    @classmethod
    def of(cls, pixels: NDArray[np.float32], wrap: tuple[WrapMode, WrapMode]) -> Sampler:
        """Returns the texture of a picture (H, W, 4) whose row 0 is the top row. v = 0 is the bottom of the picture."""
        return cls._of(Stored.of(np.ascontiguousarray(pixels[::-1]), Float(4), "RGBA"), wrap, (1, 1))

    @classmethod
    def _of(cls, stored: Stored, wrap: tuple[WrapMode, WrapMode], span: tuple[int, int]) -> Sampler:
        heights, widths = (np.array([level.shape[axis] for level in stored.levels]) for axis in (0, 1))
        starts = np.concatenate([[0], np.cumsum(heights * widths)[:-1]])
        texels = np.concatenate([level.reshape(-1, 4) for level in stored.decoded()])
        codes = None
        if isinstance(stored.format, Srgb8):
            colours = ["RGB".index(source) for source in stored.swizzle[:3]]
            codes = np.concatenate([level.reshape(-1, stored.format.channels)[:, colours] for level in stored.levels])
        return cls(texels, codes, starts, widths, heights, wrap, span)

    def decoded(self, values: Sequence[float], error: float) -> Sampler:
        """Returns the texture as a driver reads it.

        values: the linear value of each sRGB code for this driver; none if they are not known.
        error: the error with which the driver decodes codes, if `values` are not known [codes].
        """
        if self.codes is None:
            return self
        if not len(values):
            return replace(self, decoding=error)
        texels = self.texels.copy()
        texels[:, :3] = np.array(values, dtype=np.float32)[self.codes]
        return replace(self, texels=texels)

    @cached_property
    def extremes(self) -> tuple[Sampler, Sampler]:
        """The texture with colours as dark, and as bright, as the error of their decoding allows."""
        assert self.codes is not None
        codes = np.arange(256.0)
        found = []
        for error in (-self.decoding, self.decoding):
            # Beyond the last code the curve goes on.
            shifted = srgb_to_linear(np.maximum(codes + error, 0) / 255)
            texels = self.texels.copy()
            texels[:, :3] = shifted[self.codes]
            found.append(replace(self, texels=texels, decoding=0.0))
        return found[0], found[1]

    def placed(self, placement: Placement) -> Sampler:
        """Returns the texture, placed on the mesh by a matrix. placement: the rows of the matrix, from `Picture.placement`."""
        if placement == UNPLACED:
            return self
        return replace(self, placement=rounded(placement).astype(np.float64))

    def coordinates(self, uv: Array) -> Array:
        """Returns the picture's texture coordinates (N, 2) at those of a mesh (N, 2)."""
        if self.placement is None:
            return uv
        rows = self.placement.astype(uv.dtype)
        result: Array = uv @ rows[:, :2].T + rows[:, 2]
        return result

    @property
    def size(self) -> NDArray[np.float64]:
        """The number of texels of the largest level in one unit of texture coordinates, along u and along v (2,)."""
        result: NDArray[np.float64] = np.array([self.widths[0], self.heights[0]]) / np.array(self.span)
        return result

    @property
    def grid(self) -> tuple[Any, ...]:
        """All that decides the level of detail at given changes of a mesh's texture coordinates."""
        return (*self.size.tolist(), None if self.placement is None else self.placement.tobytes())

    def level(self, dx: Array, dy: Array, rule: Rule = "length") -> Array:
        """Returns the level of detail (N,) of pixels.

        dx: change of the mesh's texture coordinates from a pixel to the next one in its row (N, 2).
        dy: change of the mesh's texture coordinates from a pixel to the next one in its column (N, 2).
        rule: optional; the rule by which it follows from them.
        """
        size = self.size.astype(dx.dtype)
        if self.placement is not None:
            linear = self.placement[:, :2].T.astype(dx.dtype)
            dx, dy = dx @ linear, dy @ linear
        # A least change of 1e-30 texels per pixel keeps the logarithm finite. It is far below level 0.
        result: Array = np.log2(np.maximum(RULES[rule](dx * size, dy * size), 1e-30))
        return result

    def sample(self, uv: Array, level: Array | None = None) -> Array:
        """Returns the filtered values (N, 4) of the texture.

        uv: texture coordinates of the picture (N, 2).
        level: optional, levels of detail (N,); without them, level 0 is read, as in the vertex stage.
        """
        base = np.zeros(len(uv), dtype=np.intp)
        if self.filter == "nearest":
            result = self._nearest(uv)
            # A picture is magnified where the level of detail is at most 0 (OpenGL 4.6 core, 8.15).
            minified = np.flatnonzero(level > 0) if level is not None else base[:0]
            if level is not None and len(minified):
                result[minified] = replace(self, filter="smooth").sample(uv[minified], level[minified])
            return result
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

    def _nearest(self, uv: Array) -> Array:
        """Returns the texels (N, 4) of level 0 in which texture coordinates (N, 2) lie (OpenGL 4.6 core, equation 8.13)."""
        width, height = self.widths[:1], self.heights[:1]
        column = _wrapped(np.floor(uv[:, 0] / self.span[0] * width).astype(np.intp), width, self.wrap[0])
        row = _wrapped(np.floor(uv[:, 1] / self.span[1] * height).astype(np.intp), height, self.wrap[1])
        result: Array = self.texels[row * width + column].astype(uv.dtype)
        return result

    def _bilinear(self, uv: Array, level: NDArray[np.intp]) -> Array:
        """Returns the bilinearly filtered values (N, 4) at texture coordinates (N, 2), each from one mipmap level (N,)."""
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
    """Returns the indices of texels brought into [0, size) by a wrap mode; OpenGL 4.6, table 8.20."""
    if mode == "clamp":
        return np.clip(index, 0, size - 1)
    if mode == "repeat":
        wrapped: NDArray[np.intp] = index % size
        return wrapped
    # The indices have a period of 2 size, whose second half runs backward.
    index = index % (2 * size)
    mirrored: NDArray[np.intp] = np.minimum(index, 2 * size - 1 - index)
    return mirrored
