"""Files of measured reflectance in the format of the MERL database, as tests write them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

# What the numbers of red, green and blue in a file are multiplied by [1/sr].
SCALES = np.array([1.0, 1.15, 1.66]) / 1500


def write_merl(path: Path, f: NDArray[np.float64]) -> Path:
    """Writes reflectance f (H, D, P, 3) [1/sr] in cells over theta_h, theta_d and phi_d. Returns the path."""
    planes = np.moveaxis(f / SCALES, -1, 0)
    path.write_bytes(np.array(f.shape[:3], "<i4").tobytes() + planes.astype("<f8").tobytes())
    return path


def rough(seed: int, size: tuple[int, int, int] = (8, 6, 10), steepness: float = 2.0) -> NDArray[np.float64]:
    """Returns random reflectance (H, D, P, 3) whose binary logarithms differ by up to `steepness` between cells."""
    return 2.0 ** np.random.default_rng(seed).uniform(-steepness / 2, steepness / 2, (*size, 3))
