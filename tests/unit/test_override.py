"""Overrides: a value set is there afterwards, nothing else has changed, and a key that leads nowhere says where."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from glshade import SceneError, load
from glshade.override import OverrideError, apply, parse

NAMES = st.text("abcxyz", min_size=1, max_size=3)
LEAVES = st.integers() | st.booleans() | st.text("pq")
TABLES = st.recursive(st.dictionaries(NAMES, LEAVES), lambda inner: st.dictionaries(NAMES, inner | LEAVES), max_leaves=12)
KEYS = st.lists(NAMES, min_size=1, max_size=3).map(".".join)


def paths(node: Any, before: tuple[str, ...] = ()) -> dict[tuple[str, ...], Any]:
    """Every leaf by its path."""
    if not isinstance(node, dict):
        return {before: node}
    return {path: leaf for key, below in node.items() for path, leaf in paths(below, (*before, key)).items()}


def leads_somewhere(document: dict[str, Any], key: str) -> bool:
    node: Any = document
    for part in key.split(".")[:-1]:
        if not isinstance(node, dict):
            return False
        node = node.get(part, {})
    return isinstance(node, dict)


@given(document=TABLES, key=KEYS, value=st.integers())
def test_what_is_set_is_there_and_nothing_else_has_changed(document: dict[str, Any], key: str, value: int) -> None:
    before = copy.deepcopy(document)
    if not leads_somewhere(document, key):
        with pytest.raises(OverrideError, match="not a table"):
            apply(document, key, value)
        return
    after = paths(apply(document, key, value))
    place = tuple(key.split("."))
    assert after[place] == value
    kept = {path: leaf for path, leaf in paths(document).items() if path[: len(place)] != place}
    assert {path: leaf for path, leaf in after.items() if path != place} == kept
    assert document == before


@given(document=TABLES, one=NAMES, other=NAMES, values=st.tuples(st.integers(), st.integers()))
def test_the_order_of_independent_keys_does_not_matter(
    document: dict[str, Any], one: str, other: str, values: tuple[int, int]
) -> None:
    if one != other:
        there = apply(apply(document, one, values[0]), other, values[1])
        assert there == apply(apply(document, other, values[1]), one, values[0])


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("a.b=0.3", 0.3),
        ("a.b = [640, 360]", [640, 360]),
        ("a.b=gold", "gold"),
        ("a.b='x y'", "x y"),
        ("a.b=true", True),
        ("a.b={type='cube'}", {"type": "cube"}),
        ("a.b=1e-3", 1e-3),
        ("a.b=1/r^2", "1/r^2"),
    ],
)
def test_values_are_toml_or_words(text: str, value: Any) -> None:
    assert parse(text) == ("a.b", value)


@pytest.mark.parametrize("text", ["a", "=3", "a=", "a..b=1", "a=[1,", 'a="x'])
def test_what_is_no_assignment(text: str) -> None:
    with pytest.raises(ValueError, match="is not"):
        parse(text)


SCENE = """
objects = [ { name = "ball", shape = "sphere", material = "gold" }, { shape = "plane", material = "body" } ]
lights = [ { type = "directional", name = "key", direction = [0, -1, 0] } ]
[materials]
body = { brdf = "phong", kd = 0.5 }
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "s.toml"
    path.write_text(SCENE)
    return path


def test_a_scene_is_changed_before_it_is_checked(file: Path) -> None:
    scene = load(
        file,
        {
            "quality.fresnel": "schlick",
            "materials.body.exponent": 9,
            "materials.gold.roughness": 0.4,
            "objects.ball.shape.segments": 12,
            "objects.1.material": {"brdf": "lambert"},
            "lights.key.intensity": 3,
            "film.size": [8, 9],
            "camera.fov": 20,
            "objects.ball.quality.shading": "flat",
        },
    )
    assert scene.quality.fresnel == "schlick"
    assert scene.materials["body"].exponent == 9  # type: ignore[attr-defined]
    assert scene.materials["gold"].roughness == 0.4  # type: ignore[attr-defined]
    assert scene.materials["gold"].brdf == "metal"
    assert scene.objects[0].shape.segments == 12  # type: ignore[union-attr]
    assert scene.objects[1].material.brdf == "lambert"  # type: ignore[union-attr]
    assert scene.lights is not None
    assert scene.lights[0].intensity == 3
    assert scene.film.size == (8, 9)
    assert scene.objects[0].quality.shading == "flat"  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("key", "value", "fault"),
    [
        ("materials.bdy.kd", 1, 'materials.bdy: no material or preset is named "bdy"; did you mean "body"?'),
        ("objects.bal.shading", "flat", 'objects.bal: none is named "bal"; did you mean "ball"?'),
        ("objects.7.shading", "flat", "there are 2"),
        ("objects.1.material.kd", 1, "set materials.body.kd in its place"),
        ("materials.body.kd.texture", "x.png", "materials.body.kd is 0.5, not a table"),
        ("quality.fresnl", "exact", 'did you mean "fresnel"?'),
        ("film.size", 3, "film.size"),
    ],
)
def test_a_key_that_leads_nowhere(file: Path, key: str, value: Any, fault: str) -> None:
    with pytest.raises(SceneError) as caught:
        load(file, {key: value})
    assert fault in str(caught.value)
    assert str(file) in str(caught.value)


def test_a_mesh_file_is_a_document_too(tmp_path: Path) -> None:
    (tmp_path / "tri.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    scene = load(tmp_path / "tri.obj", {"film.samples": 1, "objects.tri.shading": "flat", "objects.tri.material": "gold"})
    assert scene.film.samples == 1
    assert scene.objects[0].shading == "flat"
    assert scene.materials["gold"].brdf == "metal"
