"""lights-linked: each light is replaced by one light for each object, which lights this object alone."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from glshade.scene.scene import Scene
from glshade.verification.laws._law import Draw, Law, NotApplicableError
from glshade.verification.laws._scenes import lights_of


def _picture(scene: Scene, draw: Draw) -> NDArray[Any]:
    lights = lights_of(scene)
    if not lights or len(scene.objects) == 1:
        raise NotApplicableError("there is only one object, or no light")
    given = {item.name for item in scene.objects}
    # The names that the law invents must not be those of other objects.
    invented = (f"{'_' * max(len(name or '') for name in given)}_{number}" for number in range(len(scene.objects)))
    objects = tuple(
        item if item.name is not None else item.model_copy(update={"name": name})
        for item, name in zip(scene.objects, invented, strict=True)
    )
    linked = tuple(
        light.model_copy(update={"only": (item.name,)})
        for light in lights
        for item in objects
        if light.only is None or item.name in light.only
    )
    return draw(scene.model_copy(update={"objects": objects, "lights": linked}))


LAW = Law(name="lights-linked", description="each light is split in one light for each object", picture=_picture)
