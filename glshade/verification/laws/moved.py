"""moved: objects, lights and camera are all moved by one translation."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.scene.scene import Scene
from glshade.verification.laws._law import Draw, Law
from glshade.verification.laws._scenes import distance, moved_world, shaded_smoothly

# The length of the translation, in multiples of the eye's distance from the scene. A renderer that
# keeps positions in float32 loses five of its seven digits.
FAR = 1e5
DIRECTION = (0.6, -0.48, 0.64)


def _picture(scene: Scene, draw: Draw) -> NDArray[Any]:
    move = np.eye(4)
    move[:3, 3] = np.multiply(DIRECTION, FAR * distance(scene))
    return draw(moved_world(scene, move))


LAW = Law(
    name="moved",
    description="the world and the camera are moved far away together",
    picture=_picture,
    premise=shaded_smoothly,
)
