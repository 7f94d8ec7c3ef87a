"""Opinions: compares the float64 reference of glshade with the ray tracer of support.third on one scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from support.third import trace

from glshade import Scene
from glshade.arrays import unrounded
from glshade.reference.picture import radiance

# The largest difference, as a share of the picture's brightest value.
ALLOWED = 1e-6
# The same where lights of opposite sign may cancel.
ALLOWED_CANCELLING = 1e-3


@dataclass(frozen=True)
class Agreement:
    """How far two pictures of a scene agree.

    worst: largest difference of a pixel that is compared, as a share of the picture's brightest value.
    allowed: the largest such difference that is allowed.
    compared: share of the picture's pixels that are compared.
    place: column and row of the pixel with the largest difference.
    """

    worst: float
    allowed: float
    compared: float
    place: tuple[int, int]

    @property
    def holds(self) -> bool:
        """Whether the pictures agree."""
        return self.worst <= self.allowed


def agreement(scene: Mapping[str, Any]) -> Agreement:
    """Returns how far the float64 reference and the ray tracer agree on a scene.

    The reference rounds transforms, colours and lights to float32, as they are uploaded, which would change its picture by up
    to 1e-5. Here it keeps them in float64. The numbers of meshes are float32 for both.
    Errors: SceneError.
    """
    traced = trace(scene)
    with unrounded():
        pixels = radiance(Scene.model_validate(dict(scene)))[..., :3]
    difference = np.where(traced.sure[..., None], np.abs(pixels - traced.pixels), 0).max(axis=2)
    brightest = np.abs(pixels).max()
    y, x = np.unravel_index(difference.argmax(), difference.shape)
    negative = any(light["intensity"] < 0 for light in scene["lights"])
    return Agreement(
        float(difference.max() / max(brightest, 1e-30)),
        ALLOWED_CANCELLING if negative else ALLOWED,
        float(traced.sure.mean()),
        (int(x), int(y)),
    )
