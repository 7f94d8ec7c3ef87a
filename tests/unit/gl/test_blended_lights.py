"""Blended surfaces that more lights reach than one page of lights holds."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import glshade
from glshade.gl.preparation import ApproximateWarning
from glshade.glsl.plan import PAGE
from glshade.scene.scene import Scene
from glshade.verification.judgement import PixelClass
from glshade.verification.verification import verify


@pytest.mark.parametrize("rate", ["gouraud", "phong"])
def test_all_pages_of_lights_are_blended_together(rate: Any, renderer: glshade.Renderer) -> None:
    """The light that a later page adds to a surface at the back is attenuated by the surfaces before it."""
    places = np.random.default_rng(4).uniform((-3, -3, 1), (3, 3, 3), (PAGE + 40, 3))
    light = {"type": "point", "falloff": "1/r^2", "intensity": 0.05}
    blended = {"brdf": "phong", "kd": (0.8, 0.5, 0.3), "alpha": 0.5, "alpha_mode": "blend", "sides": "both"}
    ball = {"shape": {"type": "sphere", "segments": 12, "rings": 6}, "material": blended, "shading": rate}
    scene = Scene.model_validate(
        {
            "film": {"size": (32, 24), "background": (0.1, 0.2, 0.3)},
            "camera": {"eye": (0, 0, 5), "target": (0, 0, 0)},
            "objects": [{**ball, "transform": {"translate": place}} for place in ((-0.7, 0, 0), (0.7, 0, -0.5))],
            "lights": [{**light, "position": tuple(place)} for place in places.tolist()],
        }
    )
    with pytest.warns(ApproximateWarning):
        verdict = verify(scene, renderer=renderer, max_ambiguous=1.0)
    assert not verdict.comparison.unexplained
    assert (verdict.classes == PixelClass.INTERIOR).sum() > 20
