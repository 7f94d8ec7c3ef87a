"""lights-split: each light is replaced by two at the same place, which are as strong together."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from glshade.scene.scene import Scene
from glshade.verification.laws._law import Draw, Law, NotApplicableError
from glshade.verification.laws._scenes import lights_of

# The parts of the intensity. They are sums of powers of two, so that the product with an intensity is seldom rounded.
SHARES = (0.375, 0.625)


def _picture(scene: Scene, draw: Draw) -> NDArray[Any]:
    lights = lights_of(scene)
    if not lights:
        raise NotApplicableError("there are no lights")
    split = (light.model_copy(update={"intensity": light.intensity * share}) for light in lights for share in SHARES)
    return draw(scene.model_copy(update={"lights": tuple(split)}))


LAW = Law(name="lights-split", description="each light is split in two weaker ones", picture=_picture)
