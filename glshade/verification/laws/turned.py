"""turned: objects, lights and camera are all turned by one rotation."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.scene.scene import Scene
from glshade.verification.laws._law import Draw, Law
from glshade.verification.laws._scenes import moved_world, shaded_smoothly

# This rotation takes no axis to an axis.
ROTATION = np.array([[2, -1, 2], [2, 2, -1], [-1, 2, 2]]) / 3


def _picture(scene: Scene, draw: Draw) -> NDArray[Any]:
    move = np.eye(4)
    move[:3, :3] = ROTATION
    return draw(moved_world(scene, move))


LAW = Law(name="turned", description="the world and the camera are turned together", picture=_picture, premise=shaded_smoothly)
