"""lights-reordered: the lights are listed in another order."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from glshade.scene.scene import Scene
from glshade.verification.laws._law import Draw, Law, NotApplicableError
from glshade.verification.laws._scenes import lights_of


def _picture(scene: Scene, draw: Draw) -> NDArray[Any]:
    lights = lights_of(scene)
    if len(lights) < 2:
        raise NotApplicableError("there are fewer than two lights")
    return draw(scene.model_copy(update={"lights": lights[::-1]}))


LAW = Law(name="lights-reordered", description="the lights are listed in reverse order", picture=_picture)
