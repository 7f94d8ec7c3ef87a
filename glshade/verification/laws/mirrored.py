"""mirrored: objects, lights and camera are all mirrored, which mirrors the picture."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.scene.scene import Scene
from glshade.verification.laws._law import Draw, Law, NotApplicableError
from glshade.verification.laws._scenes import material_of, moved_world


def _picture(scene: Scene, draw: Draw) -> NDArray[Any]:
    for index, item in enumerate(scene.objects):
        if material_of(scene, item).is_handed:
            raise NotApplicableError(f"the surface of {item.name or f'objects[{index}]'} is not its own mirror image")
    mirrored = draw(moved_world(scene, np.diag([-1.0, 1.0, 1.0, 1.0])))
    return mirrored[:, ::-1]


LAW = Law(name="mirrored", description="the mirrored world gives the mirrored picture", picture=_picture)
