"""Table: a model's table, as the machine that runs GLSL reads it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.textures.volume import Volume

Array = NDArray[Any]


@dataclass(frozen=True, eq=False)
class TableText:
    """A texture of three dimensions with one level of detail.

    volume: the table.
    """

    volume: Volume

    def sample(self, at: Array, level: Array | None, bias: Array, steps: Any) -> Array:
        """Returns the filtered texels (4, n) at texture coordinates (3, n). The level of detail has no effect."""
        found = self.volume.sample(np.asarray(at).T).T
        return np.concatenate([found, np.ones_like(found[:1])])

    def fetch(self, at: Array, level: Array) -> Array:
        """Returns the texels (4, n) at integer coordinates (3, n)."""
        x, y, z = (np.clip(at[axis].astype(np.intp), 0, count - 1) for axis, count in enumerate(self.volume.size))
        found = self.volume.texels[z, y, x].astype(np.float64).T
        return np.concatenate([found, np.ones_like(found[:1])])

    def size(self, level: Array) -> tuple[int, ...]:
        """Returns width, height and depth [texels]."""
        return self.volume.size
