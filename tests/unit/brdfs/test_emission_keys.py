"""The keys emission, occlusion and unlit are the same for every model, and wrong values are refused in one line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from glshade import Image
from glshade.brdfs import BRDFS
from glshade.live.controls import controls_of
from glshade.presets import preset
from glshade.scene.scene import Scene

each_model = pytest.mark.parametrize("name", BRDFS)


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    Image(np.full((2, 2, 3), 128, np.uint8), "srgb").save(tmp_path / "grey.png")
    return tmp_path / "grey.png"


@each_model
def test_every_model_has_the_keys(name: str, picture: Path) -> None:
    plain = BRDFS[name].model_validate({})
    assert (plain.emission, plain.occlusion, plain.unlit) == ((0, 0, 0), None, False)
    assert not plain.emits
    given = BRDFS[name].model_validate(
        {"emission": {"texture": picture, "factor": 2}, "occlusion": {"texture": picture, "strength": 0.5}, "unlit": True}
    )
    assert given.emits
    assert given.is_colour("emission")
    assert given.unlit


@each_model
def test_emission_is_no_parameter_of_the_models_struct(name: str) -> None:
    assert "emission" not in BRDFS[name].parameters()
    assert BRDFS[name].model_validate({"emission": 1}).asked("light") == BRDFS[name].model_validate({}).asked("light")


@pytest.mark.parametrize("ambient", [False, True])
@each_model
def test_a_simpler_material_emits_the_same(name: str, ambient: bool) -> None:
    """The simplest material of the same value, and the half-angle variant, keep the keys."""
    lobes = [key for key in BRDFS[name].parameters() if key.startswith("ks") or key in ("sigma", "flakes", "coat")]
    material = BRDFS[name].model_validate({"emission": (1, 2, 3), "unlit": True, **dict.fromkeys(lobes, 0)})
    for simpler in (material.canonical(ambient), material.half_angle()):
        assert (simpler.emission, simpler.unlit) == ((1, 2, 3), True)


@given(st.floats(0, 1e30), st.floats(0, 1e30), st.floats(0, 1e30))
def test_every_value_of_at_least_zero_is_allowed(r: float, g: float, b: float) -> None:
    assert BRDFS["lambert"].model_validate({"emission": (r, g, b)}).emission == (r, g, b)
    assert BRDFS["lambert"].model_validate({"emission": r}).emission == (r, r, r)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"emission": -0.5}, "must be at least 0, not -0.5"),
        ({"emission": [0, 0, float("nan")]}, "finite"),
        ({"emission": {"texture": "PICTURE", "channel": "g"}}, "a colour reads three channels"),
        ({"occlusion": 0.5}, "occlusion"),
        ({"occlusion": {"texture": "PICTURE", "strength": 1.5}}, "1"),
        ({"occlusion": {"texture": "PICTURE", "channel": "x"}}, "channel"),
        ({"unlit": 3}, "unlit"),
    ],
)
def test_wrong_values_are_refused(keys: dict[str, Any], message: str, picture: Path) -> None:
    for value in keys.values():
        if isinstance(value, dict):
            value["texture"] = picture
    with pytest.raises(ValidationError, match=message):
        BRDFS["lambert"].model_validate(keys)


def test_the_schema_has_the_bounds() -> None:
    emission = BRDFS["ggx"].model_json_schema()["properties"]["emission"]
    numbers = [part for part in emission["oneOf"][0]["anyOf"] if part["type"] == "number"]
    assert [part["minimum"] for part in numbers] == [0]


def test_a_preset_can_be_made_to_glow() -> None:
    gold = preset("gold")
    assert BRDFS[gold["brdf"]].model_validate({**gold, "emission": 1}).emits


def test_a_page_offers_a_slider(picture: Path) -> None:
    materials = {
        "lamp": {"brdf": "lambert", "emission": (1, 0.5, 0)},
        "screen": {"brdf": "ggx", "emission": {"texture": picture, "factor": (2, 2, 2)}},
    }
    objects = [{"shape": "sphere", "material": name} for name in materials]
    groups = controls_of(Scene.model_validate({"materials": materials, "objects": objects}))["groups"]
    fields = {field["key"]: field for group in groups for field in group["fields"]}
    lamp = fields["materials.lamp.emission"]
    assert (lamp["kind"], lamp["value"], lamp["bounds"]) == ("colour", [1, 0.5, 0], [0, None])
    assert fields["materials.screen.emission.factor"]["value"] == [2, 2, 2]
    assert fields["materials.lamp.unlit"]["kind"] == "boolean"
    assert len([key for key in fields if key.startswith("materials.lamp.emission")]) == 1
