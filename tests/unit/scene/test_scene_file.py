"""Scene files: TOML, JSON and mesh files alone, and the messages about files that cannot be read."""

from __future__ import annotations

import json
import math
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

from glshade import Renderer, Scene, SceneError, load

TOML = """
description = "a ball"
[film]
size = [24, 16]
samples = 4
background = [0.1, 0.2, 0.3, 0.5]
[camera]
type = "orthographic"
height = 3
eye = [0, 0, 5]
[materials.red]
brdf = "phong"
kd = [0.5, 0, 0]
ks = 0.25
exponent = 20
[[objects]]
name = "ball"
shape = { type = "sphere", rings = 12 }
material = "red"
transform = { rotate = [0, 0, 45], scale = 0.5 }
[[objects]]
shape = "plane"
parent = "ball"
material = { brdf = "lambert" }
[[lights]]
type = "spot"
position = [0, 0, 5]
direction = [0, 0, -1]
only = ["ball"]
"""
TABLE = {
    "description": "a ball",
    "film": {"size": [24, 16], "samples": 4, "background": [0.1, 0.2, 0.3, 0.5]},
    "camera": {"type": "orthographic", "height": 3, "eye": [0, 0, 5]},
    "materials": {"red": {"brdf": "phong", "kd": [0.5, 0, 0], "ks": 0.25, "exponent": 20}},
    "objects": [
        {
            "name": "ball",
            "shape": {"type": "sphere", "rings": 12},
            "material": "red",
            "transform": {"rotate": [0, 0, 45], "scale": 0.5},
        },
        {"shape": "plane", "parent": "ball", "material": {"brdf": "lambert"}},
    ],
    "lights": [{"type": "spot", "position": [0, 0, 5], "direction": [0, 0, -1], "only": ["ball"]}],
}
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def write(path: Path, content: Any) -> Path:
    path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
    return path


def problems(path: Path) -> tuple[str, ...]:
    with pytest.raises(SceneError) as caught:
        load(path)
    assert all("\n" not in problem for problem in caught.value.problems)
    return caught.value.problems


def test_toml_and_json_are_the_same_scene(tmp_path: Path, renderer: Renderer) -> None:
    toml, js = load(write(tmp_path / "a.toml", TOML)), load(write(tmp_path / "a.json", TABLE))
    assert toml == js == Scene.model_validate(TABLE)
    assert np.array_equal(renderer.render(toml).pixels.copy(), renderer.render(js).pixels)


@pytest.mark.parametrize("kind", ["toml", "json"])
def test_every_fault_has_its_file_and_key_path(kind: str, tmp_path: Path) -> None:
    if kind == "toml":
        text = TOML.replace("samples = 4", "samples = 5").replace('material = "red"', 'material = "rde"').replace("20", '"x"')
    else:
        text = json.dumps(TABLE).replace('"samples": 4', '"samples": 5').replace('"material": "red"', '"material": "rde"')
        text = text.replace("20", '"x"')
    path = write(tmp_path / f"bad.{kind}", text)
    assert problems(path) == (
        f"{path}: film.samples: 5 is not one of 1, 2, 4 or 8",
        f"{path}: materials.red.exponent: must be a number, not 'x'",
        f'{path}: objects[0].material: no material or preset is named "rde"; did you mean "red"?',
    )


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("e.toml", "", "objects: is required"),
        ("e.toml", "a = [", "is not TOML: Invalid value"),
        ("e.toml", "[film]\nsize = 1\n[film]\n", "is not TOML: Cannot declare"),
        ("e.json", "", "is not JSON: Expecting value: line 1 column 1"),
        ("e.json", "[1]", "must be a table, not [1]"),
        ("e.json", '"a"', "must be a table, not 'a'"),
        ("e.json", "null", "must be a table, not None"),
        ("e.json", "[" * 100_000, "is not JSON: "),
        ("e.json", '{"objects": {"a": {"b": 1}}}', "objects: must be a list, not {'a': {'b': 1}}"),
        ("e.json", '{"objects": [{"shape": "cube"}], "film": {"exposure": NaN}}', "film.exposure: nan is not a finite number"),
        ("e.json", '{"objects": [{"shape": "cube"}], "film": {"exposure": 1e999}}', "film.exposure: inf is not a finite"),
        ("e.json", '{"objects": [{"shape": "cube"}], "film": {"size": [1e999, 1]}}', "film.size[0]: "),
        (
            "e.json",
            '{"objects": [{"shape": "cube", "material": {"brdf": "measured", "file": 3}}]}',
            "objects[0].material.file: must be the path of a file, not 3",
        ),
        ("e.xml", "<a/>", ".xml is neither a scene nor a mesh; known: .toml, .json, "),
        ("scene", "", "no extension is neither a scene nor a mesh"),
    ],
)
def test_files_that_are_not_scenes(name: str, content: str, message: str, tmp_path: Path) -> None:
    path = write(tmp_path / name, content)
    (problem,) = problems(path)
    assert problem.startswith(f"{path}: ")
    assert message in problem


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    assert problems(tmp_path / "none.toml") == (f"{tmp_path}/none.toml: there is no such file",)
    assert "no such file" in problems(tmp_path / "none.obj")[0].lower()
    (tmp_path / "folder.toml").mkdir()
    assert problems(tmp_path / "folder.toml") == (f"{tmp_path}/folder.toml: cannot be read: Is a directory",)
    (tmp_path / "latin.toml").write_bytes("description = 'ä'".encode("latin-1"))
    assert problems(tmp_path / "latin.toml") == (f"{tmp_path}/latin.toml: is not UTF-8 text (byte 15)",)


def test_a_byte_order_mark_is_skipped(tmp_path: Path) -> None:
    (tmp_path / "bom.toml").write_bytes(b"\xef\xbb\xbf" + TOML.encode())
    assert load(tmp_path / "bom.toml") == Scene.model_validate(TABLE)


def test_files_are_found_beside_the_scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "sub").mkdir()
    write(tmp_path / "sub" / "tri.obj", TRIANGLE)
    write(tmp_path / "sub" / "a.toml", '[[objects]]\nmesh = "tri.obj"\n')
    monkeypatch.chdir(tmp_path)
    assert load("sub/a.toml").objects[0].mesh == tmp_path / "sub" / "tri.obj"
    assert load(Path("sub/tri.obj")).objects[0].mesh == tmp_path / "sub" / "tri.obj"


def test_every_mesh_that_is_missing_or_broken(tmp_path: Path) -> None:
    write(tmp_path / "empty.obj", "")
    write(tmp_path / "lines.obj", "v 0 0 0\nv 1 0 0\nl 1 3\n")
    (tmp_path / "cut.stl").write_bytes(b"\x00" * 90)
    names = ["empty.obj", "lines.obj", "cut.stl"]
    messages = problems(write(tmp_path / "a.json", {"objects": [{"mesh": name} for name in names]}))
    assert len(messages) == len(names)
    for index, (name, problem) in enumerate(zip(names, messages, strict=True)):
        assert problem.startswith(f"{tmp_path}/a.json: objects[{index}].mesh: ")
        assert name in problem
    messages = problems(
        write(tmp_path / "b.json", {"objects": [{"mesh": "no.obj"}, {"mesh": "nix.ply"}, {"mesh": "a.json/x.obj"}]})
    )
    assert [problem.split(": ")[1] for problem in messages] == [f"objects[{i}].mesh" for i in range(3)]
    assert all("does not exist" in problem for problem in messages)


@pytest.mark.parametrize("name", ["empty.obj", "none.ply", "empty.stl", "none.glb"])
def test_a_bare_mesh_with_nothing_to_draw(name: str, tmp_path: Path) -> None:
    header = "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
    write(tmp_path / name, header if name.endswith("ply") else "")
    (problem,) = problems(tmp_path / name)
    assert name in problem


def test_a_bare_mesh_is_a_scene(tmp_path: Path, renderer: Renderer) -> None:
    """It is framed by a camera and lit by the default rig, with smooth edges and a background that is not black."""
    write(tmp_path / "tri.obj", TRIANGLE)
    scene = load(tmp_path / "tri.obj")
    assert scene.film.samples == 4
    assert scene.lights is None
    scene = scene.model_copy(update={"film": scene.film.model_copy(update={"size": (64, 48)})})
    pixels = renderer.render(scene).pixels
    backdrop = pixels[0, 0]
    assert backdrop.min() > 0
    drawn = np.any(pixels != backdrop, axis=2)
    assert 0.05 < drawn.mean() < 0.6
    assert pixels[drawn].mean() > 1.5 * backdrop.mean()


def test_a_bare_mesh_has_its_own_material(tmp_path: Path, draw: Any) -> None:
    write(tmp_path / "tri.obj", "mtllib m.mtl\nusemtl green\n" + TRIANGLE)
    write(tmp_path / "m.mtl", "newmtl green\nKd 0 0.7 0\nKs 0 0 0\nKa 0 0.25 0\nNs 10\n")
    scene = load(tmp_path / "tri.obj")
    objects = [item.model_dump() for item in scene.objects]
    camera = {"type": "orthographic", "eye": [0.25, 0.25, 5], "target": [0.25, 0.25, 0], "height": 0.1}
    lights = [{"type": "directional", "direction": [0, 0, -1]}, {"type": "ambient", "intensity": 0.5}]
    assert draw(objects, lights, camera=camera)[16, 16] == pytest.approx([0, 0.7 + 0.125, 0], abs=1e-6)


@pytest.mark.parametrize("name", ["scene.TOML", "mesh.OBJ"])
def test_extensions_in_capitals(name: str, tmp_path: Path) -> None:
    assert load(write(tmp_path / name, TOML if "TOML" in name else TRIANGLE)).objects


@pytest.fixture(scope="module")
def validator() -> Any:
    schema = Scene.model_json_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


class TestSchema:
    """The JSON schema that `glshade schema` prints for editors."""

    def test_accepts_what_loads(self, validator: Any) -> None:
        assert Scene.model_validate(TABLE).objects
        assert validator.is_valid(TABLE), list(validator.iter_errors(TABLE))

    def test_accepts_every_way_of_writing_a_value(self, validator: Any, tmp_path: Path) -> None:
        write(tmp_path / "a.png", "")
        write(tmp_path / "a.obj", TRIANGLE)
        texture = {"texture": str(tmp_path / "a.png"), "wrap": "clamp", "factor": 0.5}
        material = {
            "brdf": "phong",
            "kd": texture,
            "exponent": {**texture, "wrap": ["mirror", "repeat"]},
            "normal_map": {**texture},
        }
        del material["normal_map"]["factor"]
        scene = {
            "objects": [
                {"mesh": str(tmp_path / "a.obj"), "material": material},
                {"shape": "cube", "transform": {"matrix": np.eye(4).tolist()}, "material": {"brdf": "lambert", "kd": 1}},
                {"shape": {"type": "cone"}, "transform": {"scale": [1, -2, 1]}},
            ],
            "camera": {"fov": 30},
            "lights": [{"type": "ambient"}, {"type": "point", "position": [0, 1, 2.5], "colour": 0.5, "falloff": "1/r"}],
        }
        assert len(Scene.model_validate(scene).objects) == 3
        assert validator.is_valid(scene), list(validator.iter_errors(scene))

    def test_accepts_the_scenes_that_ship(self, validator: Any) -> None:
        scenes = sorted((Path(__file__).parents[3] / "scenes").glob("**/*.toml"))
        assert scenes, "no scene ships"
        for path in scenes:
            errors = [f"{path.name}: {list(e.absolute_path)}" for e in validator.iter_errors(tomllib.loads(path.read_text()))]
            assert not errors

    @pytest.mark.parametrize(
        ("path", "value"),
        [
            (["film", "size"], [0, 1]),
            (["film", "size"], [1]),
            (["film", "samples"], 3),
            (["camera", "type"], "fisheye"),
            (["objects", 0, "shape"], "spere"),
            (["objects", 0, "shape"], {}),
            (["objects", 0, "colour"], 1),
            (["objects", 0, "mesh"], 3),
            (["objects", 0, "transform", "scale"], [1, 2]),
            (["objects", 1, "material"], {"brdf": "gold"}),
            (["objects", 1, "material"], {"kd": 1}),
            (["lights"], [{}]),
            (["lights", 0, "direction"], "down"),
            (["lights", 0, "outer"], 181),
            (["colour"], 1),
        ],
    )
    def test_refuses_what_does_not_load(self, path: list[Any], value: Any, validator: Any) -> None:
        table = json.loads(json.dumps(TABLE))
        place = table
        for key in path[:-1]:
            place = place[key]
        place[path[-1]] = value
        assert not validator.is_valid(table)
        with pytest.raises(ValueError, match="validation error"):
            Scene.model_validate(table)

    @pytest.mark.parametrize(("name", "value"), [("kd", -1), ("exponent", 2e8), ("exponent", -math.pi)])
    def test_knows_the_range_of_parameters(self, name: str, value: float, validator: Any) -> None:
        table = {**TABLE, "materials": {"red": {"brdf": "phong", name: value}}}
        assert not validator.is_valid(table)
