"""objects-reordered: the objects are listed in another order."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from glshade.scene.scene import Scene
from glshade.verification.laws._law import Draw, Law, NotApplicableError
from glshade.verification.laws._scenes import blended_objects


def _picture(scene: Scene, draw: Draw) -> NDArray[Any]:
    if len(scene.objects) == 1:
        raise NotApplicableError("there is only one object")
    # Blended objects at equal depths are drawn in the order of the scene, so they keep their order.
    blended = blended_objects(scene)
    last = [item for number, item in enumerate(scene.objects) if number in blended]
    others = [item for number, item in enumerate(scene.objects) if number not in blended]
    return draw(scene.model_copy(update={"objects": (*reversed(others), *last)}))


LAW = Law(name="objects-reordered", description="the objects are listed in reverse order", picture=_picture)
