"""Problems: errors of scenes and of includes as problems with file, line and column."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import glshade
from glshade.errors import ContextError, SceneError, ShaderError
from glshade.problem import Problem
from glshade.scene.places import Key, place_of
from glshade.scene.problems import problems_of

TOML = """# A comment with [brackets] and a = sign
description = "a [ = x # no comment"
film = { size = [3, 4], samples = 2 }
[[objects]]
shape = "sphere"
material = { brdf = "phong", kd = [1, 2,
  3] }
[[objects]]
name = 'second'
[objects.material]
brdf = "lambert"
kd.texture = "x.png"
[materials."a b".q]
r = 1e-3
"""


@pytest.mark.parametrize(
    ("key", "place"),
    [
        (("description",), (2, 1)),
        (("film", "samples"), (3, 25)),
        (("film", "size", 1), (3, 21)),
        (("objects", 0, "material", "kd", 2), (7, 3)),
        (("objects", 1, "name"), (9, 1)),
        (("objects", 1, "material", "kd", "texture"), (12, 1)),
        (("materials", "a b", "q", "r"), (14, 1)),
        # A key that the text lacks has the place of the table around it.
        (("objects", 1, "shape"), (8, 1)),
        (("objects", 2), (4, 1)),
        (("lights",), None),
    ],
)
def test_places_in_toml(key: Key, place: tuple[int, int] | None) -> None:
    assert place_of(TOML, key) == place


def test_places_in_json() -> None:
    text = '{\n  "objects": [{"shape": "plane"},\n    {"mesh": 3}]\n}\n'
    assert place_of(text, ("objects", 1, "mesh")) == (3, 6)


@pytest.mark.parametrize("text", ["", "[", "a = ", "a = [1, 2", "[[a", '{"a": {', 'x = "open\n', "= 3\n"])
def test_a_text_with_a_fault_has_the_places_before_it(text: str) -> None:
    assert place_of(f"first = 1\n{text}", ("first",)) in ((1, 1), None)
    place_of(text, ("a", 0))


def problems(folder: Path, text: str, name: str = "s.toml") -> list[Problem]:
    path = folder / name
    path.write_text(text)
    with pytest.raises(SceneError) as caught:
        glshade.load(path)
    found = list(problems_of(caught.value))
    assert {problem.file for problem in found} == {str(path)}
    return found


def test_each_fault_of_a_scene_has_its_place(tmp_path: Path) -> None:
    text = (
        '[[objects]]\nshape = "sphere"\nshadng = "flat"\nmaterial = { brdf = "lambert", kd = "red" }\n[film]\nsize = [0, 4]\n'
    )
    assert sorted((problem.line, problem.column) for problem in problems(tmp_path, text)) == [(3, 1), (4, 32), (6, 9)]


def test_the_parser_s_own_place(tmp_path: Path) -> None:
    (problem,) = problems(tmp_path, "a = 1\nb = = 2\n")
    assert (problem.line, problem.column, problem.stage) == (2, 5, "scene")
    assert problem.text().endswith("     1 | a = 1\n     2 | b = = 2\n       |     ^")
    (problem,) = problems(tmp_path, '{\n"a": tru\n}\n', "s.json")
    assert problem.line == 2


def test_files_that_a_scene_names(tmp_path: Path) -> None:
    lines = ['{ mesh = "m.obj" }', '{ shape = "plane", material = { brdf = "lambert", kd = { texture = "t.png" } } }']
    text = "objects = [\n" + ",\n".join(lines) + "]\n"
    found = [(problem.line, problem.stage) for problem in problems(tmp_path, text)]
    assert found == [(2, "mesh"), (3, "texture")]


def test_an_include(tmp_path: Path) -> None:
    path = tmp_path / "a.glsl"
    path.write_text("one\ntwo\nthree\n")
    problem, other = problems_of(ShaderError(f"{path}:2: no shader file\n{path}: is not UTF-8 text (byte 3)"))
    assert (problem.line, problem.excerpt, problem.first_line) == (2, ("one", "two", "three"), 1)
    assert (other.file, other.line, other.message) == (str(path), None, "is not UTF-8 text (byte 3)")


def test_other_errors_have_no_place() -> None:
    (problem,) = problems_of(ContextError("no context"))
    assert str(problem) == problem.text() == "no context"
    assert problem.stage == "driver"


def test_a_problem_as_text_and_as_json() -> None:
    problem = Problem("a.glsl", 2, 3, "wrong", "fragment").beside(["one", "\ttwo", "three"])
    assert str(problem) == "a.glsl:2:3: wrong"
    assert problem.text() == "a.glsl:2:3: wrong\n     1 | one\n     2 |  two\n       |   ^\n     3 | three"
    table = json.loads(json.dumps(problem.as_dict()))
    assert (table["caret"], table["first_line"], table["excerpt"]) == (3, 1, ["one", "\ttwo", "three"])
    assert problem.beside(["one"]).line == 2
