"""Default rig: the lights of a scene that lists none."""

from __future__ import annotations

from glshade.lights import LIGHTS, Light
from glshade.scene.camera import View


def rig(view: View) -> tuple[Light, ...]:
    """Returns the lights of a scene that lists none: a key light over the viewer's left shoulder, a fill light from the right,
    and a weak ambient light."""
    right, up, backward = view.axes

    def toward(x: float, y: float, z: float) -> tuple[float, ...]:
        """Returns the world-space direction of light that comes from (x, y, z), which is given in the view's axes."""
        return tuple(float(c) for c in -(x * right + y * up + z * backward))

    directional, ambient = LIGHTS["directional"], LIGHTS["ambient"]
    return (
        directional.model_validate({"name": "key", "direction": toward(-0.7, 0.9, 0.8), "intensity": 0.95}),
        directional.model_validate({"name": "fill", "direction": toward(1.0, 0.1, 0.6), "intensity": 0.2}),
        ambient.model_validate({"name": "ambient", "intensity": 0.08}),
    )
