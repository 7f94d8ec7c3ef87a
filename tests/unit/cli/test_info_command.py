"""Command `glshade info`: what files hold, in a table and as JSON."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.command import run_command

from glshade.image.image import Image
from glshade.mesh.information import mesh_information

# The corners of a cube with sides of 2, and its faces, counter-clockwise seen from outside.
CORNERS = [(x, y, z) for x in (0, 2) for y in (0, 2) for z in (0, 2)]
FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def cube(path: Path, faces: list[tuple[int, ...]] = FACES, extra: str = "") -> Path:
    """Writes an OBJ file with these faces of the cube."""
    vertices = "".join(f"v {x} {y} {z}\n" for x, y, z in CORNERS)
    path.write_text(extra + vertices + "".join("f " + " ".join(str(i + 1) for i in face) + "\n" for face in faces))
    return path


def facts(capsys: pytest.CaptureFixture[str], *arguments: object) -> list[dict[str, object]]:
    result = run_command(capsys, "info", "--json", *arguments)
    loaded = json.loads(result.out)
    assert isinstance(loaded, list)
    return loaded


def test_the_facts_of_a_cube(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (table,) = facts(capsys, cube(tmp_path / "cube.obj"))
    assert (table["kind"], table["format"], table["triangles"], table["vertices"]) == ("mesh", "OBJ", 12, 8)
    assert (table["lines"], table["points"]) == (0, 0)
    assert table["bounds"] == [[0, 0, 0], [2, 2, 2]]
    assert (table["closed"], table["open_edges"], table["winding"]) == (True, 0, "outward")
    assert table["unit"] == {"name": "metre", "guess": True}
    assert table["warnings"] == []


@pytest.mark.parametrize(
    ("faces", "closed", "open_edges", "winding"),
    [
        ([face[::-1] for face in FACES], True, 0, "inward"),
        (FACES[1:], False, 4, "consistent"),
        ([FACES[0][::-1], *FACES[1:]], True, 0, "mixed"),
        ([FACES[0]], False, 4, "consistent"),
    ],
)
def test_closed_and_winding(tmp_path: Path, faces: list[tuple[int, ...]], closed: bool, open_edges: int, winding: str) -> None:
    table = mesh_information(cube(tmp_path / "cube.obj", faces))
    assert (table["closed"], table["open_edges"], table["winding"]) == (closed, open_edges, winding)


def test_parts_with_different_materials_close_one_surface(tmp_path: Path) -> None:
    path = tmp_path / "two.obj"
    (tmp_path / "two.mtl").write_text("newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 1 0\n")
    vertices = "".join(f"v {x} {y} {z}\n" for x, y, z in CORNERS)
    lines = ["f " + " ".join(str(i + 1) for i in face) for face in FACES]
    path.write_text("mtllib two.mtl\n" + vertices + "\n".join(["usemtl a", *lines[:2], "usemtl b", *lines[2:]]) + "\n")
    table = mesh_information(path)
    assert (table["closed"], table["winding"], len(table["parts"]), len(table["materials"])) == (True, "outward", 2, 2)


def test_bodies_that_share_an_edge_are_not_mixed(tmp_path: Path) -> None:
    path = cube(tmp_path / "cube.obj")
    second = "".join(f"v {x + 2} {y + 2} {z}\n" for x, y, z in CORNERS)
    faces = "".join("f " + " ".join(str(i + 9) for i in face) + "\n" for face in FACES)
    path.write_text(path.read_text() + second + faces)
    table = mesh_information(path)
    assert (table["closed"], table["winding"], table["triangles"]) == (True, "outward", 24)


@given(turned=st.integers(0, 5))
def test_one_turned_face_is_found(tmp_path_factory: pytest.TempPathFactory, turned: int) -> None:
    faces = [face[::-1] if index == turned else face for index, face in enumerate(FACES)]
    table = mesh_information(cube(tmp_path_factory.mktemp("turned") / "cube.obj", faces))
    assert (table["closed"], table["winding"]) == (True, "mixed")


def test_a_bad_file_does_not_stop_the_others(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bad, missing, good = tmp_path / "bad.ply", tmp_path / "none.png", cube(tmp_path / "good.obj")
    bad.write_text("ply\n")
    result = run_command(capsys, "info", bad, missing, tmp_path, good)
    assert result.code == 3
    assert [line.split(": ")[1] for line in result.err.splitlines()] == [str(bad), str(missing), str(tmp_path)]
    assert "12 triangles, 8 vertices" in result.out
    listed = facts(capsys, bad, good)
    assert ["error" in table for table in listed] == [True, False]


def test_a_warning_is_a_note(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    result = run_command(capsys, "info", cube(tmp_path / "a.obj", extra="mtllib gone.mtl\n"))
    note = next(line for line in result.out.splitlines() if line.startswith("note"))
    assert "gone.mtl" in note
    assert result.code == 0


def test_textures_without_coordinates_are_a_note(tmp_path: Path) -> None:
    Image(np.zeros((1, 1, 3), dtype=np.uint8), "srgb").save(tmp_path / "red.png")
    (tmp_path / "a.mtl").write_text("newmtl a\nmap_Kd red.png\n")
    (note,) = mesh_information(cube(tmp_path / "a.obj", extra="mtllib a.mtl\nusemtl a\n"))["warnings"]
    assert note == "a has no texture coordinates; drawn without the textures of its material"


def test_a_texture_has_its_size(tmp_path: Path) -> None:
    Image(np.zeros((3, 5, 3), dtype=np.uint8), "srgb").save(tmp_path / "red.png")
    (tmp_path / "a.mtl").write_text("newmtl a\nmap_Kd red.png\n")
    path = tmp_path / "a.obj"
    path.write_text("mtllib a.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n")
    (material,) = mesh_information(path)["materials"]
    assert {"key": "kd", "file": "red.png", "size": [5, 3]} in material["textures"]


def test_the_extensions_and_unit_of_gltf(tmp_path: Path) -> None:
    import base64

    buffer = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype="<f4").tobytes()
    header = {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_materials_unlit"],
        "materials": [{"extensions": {"KHR_materials_unlit": {}}}],
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "buffers": [{"byteLength": 36, "uri": "data:;base64," + base64.b64encode(buffer).decode()}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}],
    }
    path = tmp_path / "a.gltf"
    path.write_text(json.dumps(header))
    table = mesh_information(path)
    assert table["extensions"] == {"KHR_materials_unlit": False}
    assert table["unit"] == {"name": "metre", "guess": False}


def test_the_facts_of_a_picture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "p.exr"
    Image(np.zeros((4, 6, 4), dtype=np.float32)).save(path, {"glshade:digest": "abc"})
    (table,) = facts(capsys, path)
    assert (table["kind"], table["size"], table["digest"]) == ("picture", [6, 4], "abc")
    (part,) = table["parts"]  # type: ignore[misc]
    assert (part["channels"], part["numbers"]) == (["R", "G", "B", "A"], "float")
    assert "6 x 4 pixels" in run_command(capsys, "info", path).out


def test_the_facts_of_a_scene(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "s.toml"
    path.write_text('[[objects]]\nshape = "sphere"\nmaterial = "gold"\n[cameras.side]\n')
    (table,) = facts(capsys, path)
    assert (table["kind"], table["objects"], table["materials"], table["lights"]) == ("scene", 1, ["gold"], None)
    assert table["cameras"] == ["side"]
    assert "the default lights" in run_command(capsys, "info", path).out


def test_names_cannot_take_over_the_terminal(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    result = run_command(capsys, "info", cube(tmp_path / "a.obj", extra="o \x1b[31mred\n"))
    assert "\x1b" not in result.out


def test_the_readme_names_every_command() -> None:
    root = Path(__file__).parents[3]
    commands = {path.stem for path in (root / "glshade" / "cli").glob("*.py") if not path.stem.startswith("_")}
    readme = (root / "README.md").read_text()
    assert commands
    assert [name for name in sorted(commands) if f"| `glshade {name}` |" not in readme] == []
