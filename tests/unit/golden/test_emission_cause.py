"""`glshade compare` names an emission that is missing or too strong, and base colours of unlit surfaces that are."""

from __future__ import annotations

from typing import Any

import pytest

from glshade import reference
from glshade.golden.pair import Pair
from glshade.golden.result import SceneVerdict
from glshade.golden.scene_judge import SceneJudge
from glshade.golden.sidecar import Origin
from glshade.scene.scene import Scene

SUN = {"type": "directional", "direction": [-0.3, -0.4, -1], "intensity": 0.5}


def scene(**changes: dict[str, Any]) -> Scene:
    materials: dict[str, dict[str, Any]] = {
        "lamp": {"brdf": "phong", "kd": 0.3, "emission": (0.4, 0.3, 0.1)},
        "sign": {"brdf": "lambert", "kd": (0.2, 0.6, 0.4), "unlit": True},
    }
    ball = {"type": "sphere", "segments": 16, "rings": 8}
    objects = [
        {
            "name": name,
            "shape": ball,
            "material": {**material, **changes.get(name, {})},
            "transform": {"translate": (2 * i, 0, 0)},
        }
        for i, (name, material) in enumerate(materials.items())
    ]
    return Scene.model_validate({"film": {"size": (64, 32)}, "objects": objects, "lights": [SUN]})


@pytest.mark.parametrize(
    ("changes", "cause"),
    [
        ({"lamp": {"emission": 0}}, "emission of lamp x 0.00"),
        ({"lamp": {"emission": (0.8, 0.6, 0.2)}}, "emission of lamp x 2.00"),
        ({"sign": {"kd": (0.1, 0.3, 0.2)}}, "emission of sign x 0.50"),
    ],
)
def test_the_cause_is_named(changes: dict[str, Any], cause: str) -> None:
    right, wrong = (reference.render(made).pixels for made in (scene(), scene(**changes)))
    origin = Origin(made_by="reference")
    found = SceneJudge(scene()).judge(Pair("", tuple("RGB"), right, wrong), origin, origin)
    assert found is not None
    assert found.verdict is SceneVerdict.REGRESSION
    assert [(one.kind, one.text) for one in found.causes] == [("emission", cause)]
