"""unit: all lengths of the scene are given in another unit."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.scene.scene import Scene
from glshade.verification.laws._law import Draw, Law
from glshade.verification.laws._scenes import moved_world, shaded_smoothly

# The number of inches in a unit of ten centimetres. A power of two would hide errors of rounding.
SCALE = 3.937


def _picture(scene: Scene, draw: Draw) -> NDArray[Any]:
    return draw(moved_world(scene, np.diag([SCALE, SCALE, SCALE, 1.0]), SCALE))


LAW = Law(name="unit", description="all lengths are given in another unit of length", picture=_picture, premise=shaded_smoothly)
