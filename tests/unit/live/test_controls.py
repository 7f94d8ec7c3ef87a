"""Controls: every value that a page offers can be set, and has a type and a range that fit it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from support.drawn import SCENE

from glshade import load
from glshade.brdfs import BRDFS
from glshade.live.controls import controls_of

SCENES = sorted((Path(__file__).parents[3] / "scenes").glob("*.toml"))


def fields(path: Path, values: Mapping[str, Any] | None = None) -> dict[str, dict[str, Any]]:
    """Key -> field, of a scene's controls. values: key -> value, in place of those of the file."""
    return {field["key"]: field for group in controls_of(load(path, values or {}))["groups"] for field in group["fields"]}


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_every_value_can_be_set_to_what_it_is(path: Path) -> None:
    found = fields(path)
    json.dumps(found, allow_nan=False)
    values = {
        key: field["value"]
        for key, field in found.items()
        # A table of a model alone gives its parameters their defaults.
        if field["value"] is not None and not isinstance(field["value"], dict)
    }
    assert fields(path, values) == found


@pytest.mark.parametrize("end", [0, 1])
def test_the_ends_of_a_slider_can_be_set(end: int, tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    for key, field in fields(path).items():
        if "usual" in field and not key.endswith((".scale", ".up", ".direction", ".eye", ".target")):
            low, high = field["bounds"]
            value = field["usual"][end]
            assert low is None or value >= low, key
            assert high is None or value <= high, key
            load(path, {key: value if field["kind"] == "number" else [value] * len(field["value"])})


def test_choices_can_be_made(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    found = fields(path)
    for field in found.values():
        for choice in field.get("choices", ()):
            load(path, {field["key"]: choice["value"] if isinstance(choice, dict) else choice})
    assert {choice["label"] for choice in found["materials.left"]["choices"]} == set(BRDFS)
    assert {"left", "right", "gold"} <= set(found["objects.0.material"]["choices"])


def test_a_field_says_what_it_is(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    found = fields(path)
    exponent = found["materials.left.exponent"]
    assert (exponent["kind"], exponent["value"], exponent["label"]) == ("number", 20.0, "exponent")
    declared = BRDFS["phong"].parameters()["exponent"]
    assert exponent["usual"] == list(declared.usual)
    assert exponent["bounds"] == [declared.low, declared.high]
    assert exponent["description"] == declared.description
    assert found["materials.left.kd"]["kind"] == "colour"
    assert found["lights.0.colour"]["kind"] == "colour"
    assert found["lights.0.direction"]["kind"] == "vector"
    assert found["camera.fov"]["bounds"] == [0.0, 180.0]
    assert found["quality.normalise"]["kind"] == "boolean"
    assert found["quality.shading"]["choices"] == ["flat", "gouraud", "phong"]


def test_names_with_dots_are_quoted(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(SCENE.replace("materials.left]", 'materials."v1.2"]').replace('"left"', '"v1.2"'))
    assert fields(path)['materials."v1.2".exponent']["value"] == 20
