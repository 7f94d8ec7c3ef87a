"""Overrides: the value is set, nothing else changes, and the message about a key that leads nowhere says how far it leads."""

from __future__ import annotations

import copy
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from glshade import Scene, SceneError, load
from glshade.scene.file import SceneFile
from glshade.scene.override import LISTS, OverrideError, apply, pairs, parse, split

NAMES = st.text("abcxyz", min_size=1, max_size=3)
LEAVES = st.integers() | st.booleans() | st.text("pq")
TABLES = st.recursive(st.dictionaries(NAMES, LEAVES), lambda inner: st.dictionaries(NAMES, inner | LEAVES), max_leaves=12)
KEYS = st.lists(NAMES, min_size=1, max_size=3).map(".".join)


def paths(node: Any, before: tuple[str, ...] = ()) -> dict[tuple[str, ...], Any]:
    """Returns every leaf of nested tables by its path."""
    if not isinstance(node, dict):
        return {before: node}
    return {path: leaf for key, below in node.items() for path, leaf in paths(below, (*before, key)).items()}


def is_settable(document: dict[str, Any], key: str) -> bool:
    node: Any = document
    for part in key.split(".")[:-1]:
        if not isinstance(node, dict):
            return False
        node = node.get(part, {})
    return isinstance(node, dict)


@given(document=TABLES, key=KEYS, value=st.integers())
def test_the_value_is_set_and_nothing_else_changes(document: dict[str, Any], key: str, value: int) -> None:
    before = copy.deepcopy(document)
    if not is_settable(document, key):
        with pytest.raises(OverrideError, match="not a table"):
            apply(document, key, value)
        return
    after = paths(apply(document, key, value))
    place = tuple(key.split("."))
    assert after[place] == value
    kept = {path: leaf for path, leaf in paths(document).items() if path[: len(place)] != place}
    assert {path: leaf for path, leaf in after.items() if path != place} == kept
    assert document == before


# Names that have to stand in quotes within a key.
ODD_NAMES = st.text("ax. =[]'é0", min_size=1, max_size=4)
ITEMS = st.text("pqr.", min_size=1, max_size=2)


def _nodes(inner: Any) -> Any:
    """Returns a strategy for tables, lists, and lists whose items have names, all with values of the strategy `inner`."""
    named = st.dictionaries(ITEMS, st.dictionaries(ODD_NAMES, inner, max_size=3), max_size=3)
    return (
        st.dictionaries(ODD_NAMES, inner, max_size=4)
        | st.lists(inner, max_size=3)
        | named.map(lambda items: [{"name": name, **item} for name, item in items.items()])
    )


DOCUMENTS = st.dictionaries(ODD_NAMES, st.recursive(LEAVES, _nodes, max_leaves=12), min_size=1, max_size=4)
Place = tuple[str | int, ...]


def places(node: Any, before: Place = ()) -> Iterator[Place]:
    """Yields the place of every value except the items' names, since keys find the items by their names."""
    below = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for part, value in below:
        if part != "name":
            yield (*before, part)
            yield from places(value, (*before, part))


def at(document: Any, place: Place) -> Any:
    for part in place:
        document = document[part]
    return document


def within(place: Place, other: Place) -> bool:
    return place[: len(other)] == other


def written(document: Any, place: Place, by_name: bool) -> str:
    """Returns the dotted key of a place. by_name: whether items of lists are named where they have a name, or numbered."""
    parts = []
    for i, part in enumerate(place):
        item = at(document, place[: i + 1])
        name = item["name"] if by_name and isinstance(part, int) and isinstance(item, dict) and "name" in item else part
        parts.append(str(name) if re.fullmatch(r"\w+", str(name)) else f'"{name}"')
    return ".".join(parts)


@given(document=DOCUMENTS, data=st.data(), value=st.integers(), by_name=st.booleans())
def test_every_existing_value_can_be_set(document: dict[str, Any], data: Any, value: int, by_name: bool) -> None:
    before = copy.deepcopy(document)
    place = data.draw(st.sampled_from(list(places(document))))
    key, by_number = written(document, place, by_name), written(document, place, by_name=False)
    after = apply(document, key, value)
    assert at(after, place) == value
    assert document == before
    assert apply(after, by_number, at(document, place)) == before, "nothing else has changed"
    assert apply(apply(document, key, "x"), by_number, value) == after, "the last value that is set is valid"


@given(document=DOCUMENTS, data=st.data(), by_name=st.booleans())
def test_the_order_of_independent_keys_does_not_matter(document: dict[str, Any], data: Any, by_name: bool) -> None:
    any_place = st.sampled_from(list(places(document)))
    first, second = data.draw(any_place), data.draw(any_place)
    assume(not within(first, second) and not within(second, first))
    # An item that is replaced by a number has no name any more, so later keys could not find it by its name.
    by_name = by_name and not isinstance(first[-1], int) and not isinstance(second[-1], int)
    first_key, second_key = written(document, first, by_name), written(document, second, by_name)
    result = apply(apply(document, first_key, 1), second_key, 2)
    assert result == apply(apply(document, second_key, 2), first_key, 1)
    assert (at(result, first), at(result, second)) == (1, 2)


@pytest.mark.parametrize("key", ["objects[1].kd", "objects.1.kd", "objects.b.kd", "'objects' . \"b\".kd", "objects [1].kd"])
def test_ways_to_write_one_key(key: str) -> None:
    document = {"objects": [{"name": "a"}, {"name": "b", "kd": 1}]}
    assert apply(document, key, 2) == {"objects": [{"name": "a"}, {"name": "b", "kd": 2}]}


@pytest.mark.parametrize("key", ["", ".", "a.", ".a", "a..b", 'a."b', "a[x]", "a[-1]", "[0]", "a=b", "a b.'c'd"])
def test_texts_that_are_not_keys(key: str) -> None:
    with pytest.raises(OverrideError, match="is not a dotted key"):
        apply({}, key, 1)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("a.b=0.3", 0.3),
        ("a.b = [640, 360]", [640, 360]),
        ("a.b=[640,\n360]", [640, 360]),
        ("a.b=gold", "gold"),
        ("a.b='x y'", "x y"),
        ("a.b='true'", "true"),
        ("a.b=true", True),
        ("a.b={type='cube'}", {"type": "cube"}),
        ("a.b=1e-3", 1e-3),
        ("a.b=1/r^2", "1/r^2"),
        ("a.b=c=d", "c=d"),
    ],
)
def test_values_are_toml_or_bare_words(text: str, value: Any) -> None:
    key, word = split(text)
    assert (key, parse(word)) == ("a.b", value)
    assert pairs([split(text)]) == [("a.b", value)]


@given(value=st.integers() | st.booleans() | st.floats(allow_nan=False, allow_infinity=False) | st.text("ab \"\\é=#'"))
def test_the_text_of_a_value_is_parsed_back(value: Any) -> None:
    assert parse(json.dumps(value, ensure_ascii=False)) == value
    assert parse(json.dumps([value, value], ensure_ascii=False)) == [value, value]


@pytest.mark.parametrize("text", ["a", "=3", "a=", "a..b=1", "a=[1,", 'a="x', "a=3\nb=4", "a[x]=1", "a=" + "[" * 9999])
def test_texts_that_are_not_assignments(text: str) -> None:
    with pytest.raises(ValueError, match="is not") as caught:
        split(text)
    assert len(str(caught.value)) < 200


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
        ("objects.bal.shading", "flat", 'objects.bal: no item is named "bal"; did you mean "ball"?'),
        ("objects.7.shading", "flat", "objects.7: the list has 2 items, numbered from 0"),
        ("objects." + "9" * 5000 + ".shading", "flat", "the list has 2 items, numbered from 0"),
        ("objects.².shading", "flat", 'no item is named "²"; allowed: 0 to 1, ball'),
        ("lights.rim.intensity", 2, 'lights.rim: no item is named "rim"; allowed: 0 to 0, key'),
        ("animation.turn.values", [], "the scene lists no animation"),
        ("film.size", 3, "film.size: must be a list, not 3 (from --set)"),
        ("quality.fresnel", "schlik", "'schlik' is not one of 'exact' or 'schlick' (from --set)"),
        ("materials", {}, 'objects[1].material: no material or preset is named "body"'),
        ("objects.1.material.kd", 1, "set materials.body.kd in its place"),
        ("materials.body.kd.texture", "x.png", "materials.body.kd is 0.5, not a table"),
        ("quality.fresnl", "exact", 'did you mean "fresnel"?'),
    ],
)
def test_a_key_that_leads_nowhere(file: Path, key: str, value: Any, fault: str) -> None:
    with pytest.raises(SceneError) as caught:
        load(file, {key: value})
    assert fault in str(caught.value)
    assert str(file) in str(caught.value)


def test_faults_of_the_file_and_faults_from_set(tmp_path: Path) -> None:
    path = tmp_path / "s.toml"
    path.write_text(SCENE + "[film]\nsamples = 3\n[cameras.top]\nfov = 30\n")
    own = f"{path}: film.samples: 3 is not one of 1, 2, 4 or 8"
    for camera in (None, "top"):
        with pytest.raises(SceneError) as caught:
            SceneFile(path, {"materials.body.exponent": -1}).scene(None, camera)
        assert caught.value.problems == (own, f"{path}: materials.body.exponent: must be at least 0, not -1 (from --set)")
    with pytest.raises(SceneError) as caught:
        load(path)
    assert caught.value.problems == (own,)
    assert load(path, {"film.samples": 2}).film.samples == 2


def test_a_fault_of_a_file_that_was_set(file: Path) -> None:
    (file.parent / "empty.obj").write_text("")
    with pytest.raises(SceneError, match=r"objects\[0\]\.mesh: .*empty\.obj.* \(from --set\)"):
        load(file, {"objects.0": {"mesh": "empty.obj"}})


def test_every_key_that_leads_nowhere_is_reported(file: Path) -> None:
    with pytest.raises(SceneError) as caught:
        load(file, {"objects.bal.shading": "flat", "film.samples": 4, "materials.bdy.kd": 1})
    assert [problem.split(": ")[1] for problem in caught.value.problems] == ["--set objects.bal", "--set materials.bdy"]


def test_pairs_are_texts_in_their_order(file: Path) -> None:
    """A key may come more than once, and a string in a pair is parsed as on a command line."""
    scene = load(file, [("film.samples", "4"), ("film", "{ size = [8, 9] }"), ("film.size.0", "7"), ("description", "'4'")])
    assert (scene.film.samples, scene.film.size, scene.description) == (1, (7, 9), "4")
    assert load(file, [("film.size", (8, 9))]).film.size == (8, 9)
    assert load(file, {"description": "4"}).description == "4", "a string in a mapping is the value itself"
    with pytest.raises(SceneError, match=r"s\.toml: --set film\.size: '\[8' is not a value of TOML"):
        load(file, [("film.size", "[8")])


@pytest.mark.parametrize("text", ['"a"', "[1]", '[{"name": "film"}]', "null", "3"])
def test_a_file_that_is_not_a_table(text: str, tmp_path: Path) -> None:
    (tmp_path / "s.json").write_text(text)
    with pytest.raises(SceneError, match=r"s\.json: must be a table"):
        load(tmp_path / "s.json", {"film.samples": 4})


@pytest.mark.parametrize(
    ("text", "key", "fault"),
    [
        (
            '{"objects": [{"name": 1, "shape": "cube"}, {"name": "a", "shape": "cube"}]}',
            "objects.b.shading",
            "allowed: 0 to 1, a",
        ),
        ('{"objects": []}', "objects.b.shading", "objects.b: objects is empty"),
        ('{"objects": [{"shape": "cube"}]}', "lights.key.intensity", "lights.key: the scene lists no lights"),
        ('{"objects": [{"shape": "cube"}], "lights": null}', "lights.0.intensity", "lights.0: the scene lists no lights"),
        ('{"objects": [{"material": "v1.2"}]}', "objects.0.material.kd", 'set materials."v1.2".kd in its place'),
    ],
)
def test_lists_without_such_an_item(text: str, key: str, fault: str, tmp_path: Path) -> None:
    (tmp_path / "s.json").write_text(text)
    with pytest.raises(SceneError) as caught:
        load(tmp_path / "s.json", {key: 1})
    (problem,) = caught.value.problems
    assert problem.endswith(fault)


def test_the_lists_are_those_of_the_schema() -> None:
    def is_list(schema: dict[str, Any]) -> bool:
        return schema.get("type") == "array" or any(map(is_list, schema.get("anyOf", ())))

    assert {name for name, schema in Scene.model_json_schema()["properties"].items() if is_list(schema)} == LISTS


def test_values_of_a_mesh_file_can_be_set(tmp_path: Path) -> None:
    (tmp_path / "tri.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    scene = load(tmp_path / "tri.obj", {"film.samples": 1, "objects.tri.shading": "flat", "objects.tri.material": "gold"})
    assert scene.film.samples == 1
    assert scene.objects[0].shading == "flat"
    assert scene.materials["gold"].brdf == "metal"
