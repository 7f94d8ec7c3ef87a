"""Flat inputs: the changed program has no more uniforms in its fragment stage, and draws the same picture to the bit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from glshade import Renderer, Scene, explain
from glshade.gl import preparation
from glshade.glsl.flat_inputs import with_flat_inputs
from glshade.glsl.generator import generate
from glshade.glsl.source import Source

LAMPS = [{"type": "point", "position": [3 - i, i, 4], "colour": [1, 0.5, 0.1 * i], "falloff": "1/r"} for i in range(8)]
SUN, SKY = {"type": "directional", "direction": [-1, -2, -1]}, {"type": "ambient", "intensity": 0.1}
PHONG = {"brdf": "phong", "kd": [0.7, 0.3, 0.2], "ks": 0.4, "exponent": 30, "ka": [0.1, 0.2, 0.3]}
SOFT = {"brdf": "ggx", "f0": [0.9, 0.6, 0.3], "roughness": 0.4}


def scene(material: Any = PHONG, lights: Any = (SUN, SKY), **keys: Any) -> Scene:
    ball = {"shape": {"type": "sphere", "segments": 24, "rings": 12}, "material": material, **keys}
    return Scene.model_validate({"objects": [ball], "lights": list(lights), "film": {"size": [96, 64]}})


def source(given: Scene) -> Source:
    (plan,) = explain(given).programs
    return generate(plan)


def uniforms(stage: Any) -> list[str]:
    return [line.split()[2] for line in stage.text.splitlines() if line.startswith("uniform ")]


def test_what_was_uniform_in_the_fragment_stage_is_handed_on() -> None:
    plain = source(scene(lights=[*LAMPS, SKY]))
    flat = with_flat_inputs(plain, 32)
    assert uniforms(plain.fragment)
    assert uniforms(flat.fragment) == []
    assert set(uniforms(flat.vertex)) == {*uniforms(plain.vertex), *uniforms(plain.fragment)}
    for stage in (flat.vertex, flat.fragment):
        assert stage is not None
        assert len(stage.lines) == len(stage.text.splitlines()), "every line has its place"


@pytest.mark.parametrize("room", [0, 2, 3, 11, 15, 32])
def test_no_more_than_there_is_room_for(room: int) -> None:
    flat = with_flat_inputs(source(scene(lights=[*LAMPS, SKY])), room)
    assert flat.fragment is not None
    inputs = [line for line in flat.fragment.text.splitlines() if " in " in line and line.endswith(";") and "(" not in line]
    taken = sum(int(line.split("[")[1].rstrip("];")) if "[" in line else 1 for line in inputs)
    assert taken <= max(room, 2), "position and normal were there before"
    assert bool(uniforms(flat.fragment)) == (room < 30)


@pytest.mark.parametrize("rate", ["flat", "gouraud", "phong"])
@pytest.mark.parametrize(
    ("material", "lights"),
    [(PHONG, (SUN, SKY)), (PHONG, (*LAMPS, SKY)), (SOFT, (SUN, LAMPS[0])), (PHONG, [LAMPS[0]] * 12), (PHONG, [])],
    ids=["sun", "lamps", "ggx", "page", "dark"],
)
def test_the_picture_is_the_same(rate: str, material: Any, lights: Any, renderer: Renderer, monkeypatch: Any) -> None:
    given = scene(material, lights, shading=rate)
    pictures = []
    for pixels_a_triangle in (0, 10**9):
        monkeypatch.setattr(preparation, "FLAT_PIXELS", pixels_a_triangle)
        pictures.append(renderer.render(given.model_copy(), dtype="float32").pixels)
    np.testing.assert_array_equal(*pictures)


def test_a_message_names_the_original_file(renderer: Renderer) -> None:
    flat = with_flat_inputs(source(scene()), 32)
    assert flat.fragment is not None
    where = next(i for i, line in enumerate(flat.fragment.text.splitlines(), 1) if "float NoV" in line)
    assert "brdf/phong.glsl" in flat.fragment.place(where)
