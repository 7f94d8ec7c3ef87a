"""exposed: one stop more exposure makes up for lights of half the strength."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from glshade.scene.scene import Scene
from glshade.verification.laws._law import Draw, Law, NotApplicableError
from glshade.verification.laws._scenes import lights_of


def _picture(scene: Scene, draw: Draw) -> NDArray[Any]:
    lights = lights_of(scene)
    if not lights:
        raise NotApplicableError("there are no lights")
    halved = tuple(light.model_copy(update={"intensity": light.intensity / 2}) for light in lights)
    film = scene.film.model_copy(update={"exposure": scene.film.exposure + 1})
    return draw(scene.model_copy(update={"film": film, "lights": halved}))


LAW = Law(name="exposed", description="one stop of exposure makes up for lights of half the strength", picture=_picture)
