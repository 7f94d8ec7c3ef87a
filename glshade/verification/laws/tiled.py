"""tiled: the picture is drawn in tiles."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from glshade.scene.scene import Scene
from glshade.verification.laws._law import Draw, Law


def _picture(scene: Scene, draw: Draw) -> NDArray[Any]:
    return draw(scene, tile=max(max(scene.film.size) // 3, 1))


LAW = Law(name="tiled", description="the picture is drawn in tiles; the reference does not use any", picture=_picture)
