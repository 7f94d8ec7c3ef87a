"""mirrored: objects, lights and camera are all mirrored, which mirrors the picture."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.scene.scene import Scene
from glshade.verification.laws._law import Draw, Law
from glshade.verification.laws._scenes import moved_world


def _picture(scene: Scene, draw: Draw) -> NDArray[Any]:
    mirrored = draw(moved_world(scene, np.diag([-1.0, 1.0, 1.0, 1.0])))
    return mirrored[:, ::-1]


LAW = Law(name="mirrored", description="the mirrored world gives the mirrored picture", picture=_picture)
