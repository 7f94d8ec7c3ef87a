"""parents-flattened: each object has the product of its parents' transforms and its own in place of a parent."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from glshade.scene.scene import Scene
from glshade.verification.laws._law import Draw, Law, NotApplicableError
from glshade.verification.laws._scenes import flattened


def _picture(scene: Scene, draw: Draw) -> NDArray[Any]:
    if all(item.parent is None for item in scene.objects):
        raise NotApplicableError("no object has a parent")
    return draw(flattened(scene))


LAW = Law(name="parents-flattened", description="parents are replaced by products of transforms", picture=_picture)
