"""OBJ files: every form of their statements, and files that are large or broken."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glshade.errors import AssetError
from glshade.mesh.normals import with_normals
from glshade.mesh.reading import obj_text
from tests.support.mesh_contents import area, corners, mesh_of, places, read_mesh

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
# Two squares that meet at a right angle along x = 1.
CORNER = SQUARE + "v 1 0 -1\nv 1 1 -1\n"


def named(found: Any) -> list[str]:
    return [part["name"] for part in found.parts]


# --- Smoothing groups ------------------------------------------------------------------------------------------------


def test_a_smoothing_group_is_smooth_whatever_the_angle() -> None:
    mesh = mesh_of(read_mesh("a.obj", CORNER + "s 1\nf 1 2 3 4\nf 2 5 6 3\n"))
    assert mesh.normals is not None
    middle = mesh.normals[np.flatnonzero(places(mesh)[:, 0] == 1)]
    np.testing.assert_allclose(
        middle[(places(mesh)[places(mesh)[:, 0] == 1])[:, 2] == 0], [[0.5**0.5, 0, 0.5**0.5]] * 2, atol=1e-6
    )


@pytest.mark.parametrize("statements", [("s 1", "s 2"), ("s off", "s off"), ("s 0", "s 0"), ("s 1", "s off")])
def test_between_smoothing_groups_edges_are_sharp(statements: tuple[str, str]) -> None:
    mesh = mesh_of(read_mesh("a.obj", CORNER + f"{statements[0]}\nf 1 2 3 4\n{statements[1]}\nf 2 5 6 3\n"))
    assert mesh.normals is not None
    assert set(map(tuple, np.abs(mesh.normals).round(6).tolist())) == {(0, 0, 1), (1, 0, 0)}


def test_a_file_without_smoothing_groups_leaves_normals_to_the_object() -> None:
    assert mesh_of(read_mesh("a.obj", CORNER + "f 1 2 3 4\nf 2 5 6 3\n")).normals is None


@pytest.mark.parametrize("smoothing", ["", "s 1\n"])
def test_normals_run_across_the_border_of_two_materials(smoothing: str) -> None:
    """Two squares that meet at 20 degrees have the same normals whether they have one material or two."""
    bent = SQUARE + "v 1.94 0 -0.342\nv 1.94 1 -0.342\n" + smoothing
    one = read_mesh("a.obj", bent + "usemtl a\nf 1 2 3 4\nf 2 5 6 3\n")
    two = read_mesh("a.obj", bent + "usemtl a\nf 1 2 3 4\nusemtl b\nf 2 5 6 3\n")
    assert named(two) == ["a", "b"]

    def at_the_border(found: Any, part: int) -> Any:
        mesh = with_normals(mesh_of(found, part), "auto", 30)
        assert mesh.normals is not None
        return mesh.normals[places(mesh)[:, 0] == 1]

    for part in range(2):
        np.testing.assert_allclose(at_the_border(two, part), at_the_border(one, 0)[:2], atol=1e-6)
    assert np.abs(at_the_border(one, 0)[:, 0] - np.sin(np.radians(10))).max() < 1e-3


# --- Corners and numbers ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "face", ["1/ 2/ 3/", "1// 2// 3//", "1/1/ 2/1/ 3/1/", "1//1 2//1 3//1", "1/0/0 2/0/0 3/0/0", "-4/-1/-1 2/1/1 +3/1/1"]
)
def test_corners_may_leave_numbers_out(face: str) -> None:
    found = read_mesh("a.obj", SQUARE + f"vt 0.5 0.5\nvn 0 0 1\nf {face}  # comment\nf 1 2 3#comment\n")
    assert area(found) == pytest.approx(1)


@given(
    st.lists(st.tuples(st.sampled_from(["{v}", "{v}/{t}", "{v}//{n}", "{v}/{t}/{n}"]), st.booleans()), min_size=3, max_size=12)
)
def test_any_mixture_of_forms_keeps_the_positions(forms: list[tuple[str, bool]]) -> None:
    lines = []
    for form, negative in forms:
        numbers = [(v - 5, -1, -1) if negative else (v, 1, 1) for v in (1, 2, 3)]
        lines.append("f " + " ".join(form.format(v=v, t=t, n=n) for v, t, n in numbers))
    found = read_mesh("a.obj", SQUARE + "vt 0 0\nvn 0 0 1\n" + "\n".join(lines))
    assert area(found) == pytest.approx(0.5 * len(forms))
    assert {(mesh.uvs is None, mesh.normals is None) for mesh in found.meshes} == {
        ("{t}" not in form, "{n}" not in form) for form, _ in forms
    }


@pytest.mark.parametrize(
    "encoded",
    [
        SQUARE.encode("utf-8-sig") + b"f 1 2 3 4\n",
        (SQUARE + "f 1 2 3 4\n").encode("utf-16"),
        (SQUARE + "f 1 2 3 4\n").encode("utf-16-be"),
        (SQUARE + "f 1 2 3 4\n").replace("\n", "\r\n").encode(),
        (SQUARE + "f 1 2 3 4").replace("\n", "\r").encode(),
        (SQUARE + "f 1 2 \\\n3 \\\r\n 4").encode(),
        b"o caf\xe9\n" + SQUARE.encode() + b"f 1 2 3 4\n",
        (SQUARE + "f 1 2 3 4 \\").encode(),
    ],
    ids=["bom", "utf-16", "utf-16-be", "crlf", "cr", "continued", "latin-1", "backslash"],
)
def test_texts_of_other_systems(encoded: bytes) -> None:
    assert area(read_mesh("a.obj", encoded)) == pytest.approx(1)


def test_a_piece_ends_anywhere(monkeypatch: pytest.MonkeyPatch) -> None:
    """The file is read in pieces; their borders change nothing, nor the numbers of lines in messages."""
    text = "# comment\nvt 0 0\n" + SQUARE.replace("v 1 1 0", "v 1 \\\n 1 0") + "f -4 -3 -2 -1\n" * 3 + "f 1 2 9\n"
    whole = read_mesh("a.obj", text.replace("f 1 2 9\n", ""))
    for size in (1, 7, 20, 64):
        monkeypatch.setattr(obj_text, "PIECE", size)
        np.testing.assert_array_equal(corners(read_mesh("a.obj", text.replace("f 1 2 9\n", ""))), corners(whole))
        with pytest.raises(AssetError, match=r"a\.obj: line 11: 'v' index out of range"):
            read_mesh("a.obj", text)


@pytest.mark.parametrize("word", ["nan", "-nan(ind)", "1.#IND", "-1.#QNAN0"])
def test_unused_vertices_may_be_no_numbers(word: str) -> None:
    assert area(read_mesh("a.obj", SQUARE + f"v {word} 0 0\nf 1 2 3 4\n")) == pytest.approx(1)


def test_faces_and_lines_with_too_few_corners_are_left_out() -> None:
    found = read_mesh("a.obj", SQUARE + "f 1 2\nf 1 2 3 4\nl 4\nf\np\n")
    assert named(found) == ["a"]
    assert area(found) == pytest.approx(1)
    assert found.warnings == ["a.obj: line 5: a face needs three corners; drawn without 4 such elements"]


def test_the_beginning_of_a_number_is_read_with_a_warning() -> None:
    found = read_mesh("a.obj", SQUARE.replace("v 1 1 0", "v 1.0+e2 1 0") + "f 1 2 3 4\n")
    assert area(found) == pytest.approx(1)
    assert found.warnings == ["a.obj: line 3: '1.0+e2' is not a number; read as 1.0"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("v 1 zero 0\nf 1 1 1\n", "line 1: 'zero' is not a number"),
        ("v 1,5 0 0\nf 1 1 1\n", "line 1: '1,5' is not a number"),
        ("v 1 0\nf 1 1 1\n", "line 1: 'v' needs at least 3 numbers"),
        (SQUARE + "f 1 2 3.5\n", "line 5: '3.5' is not a corner"),
        (SQUARE + "f 1 2 1-2\n", "line 5: '1-2' is not a corner"),
        (SQUARE + "f 1 2 /3\n", "line 5: '/3' is not a corner"),
        (SQUARE + "f 1 2 3/1/1/1\n", "line 5: '3/1/1/1' is not a corner"),
        (SQUARE + "f\n", "line 5: a face needs three corners"),
        (SQUARE + "l 1\n", "line 5: a line needs two corners"),
        (SQUARE + "f 1 2 99999999999999999999\n", "line 5: 'v' index out of range: the file has 4"),
        (SQUARE + "f 1 2 -99999999999999999999\n", "line 5: 'v' index out of range: the file has 4"),
        (SQUARE + "surf 0 1 0 1 1 2 3 4\n", "only free-form curves and surfaces"),
    ],
)
def test_errors_name_the_line_and_the_word(text: str, message: str) -> None:
    with pytest.raises(AssetError) as caught:
        read_mesh("a.obj", text)
    assert message in str(caught.value)
    assert str(caught.value).startswith("a.obj: ")
    assert "\n" not in str(caught.value)


# --- Colours ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("row", "colour"),
    [
        ("1 0 0.5", [1, 0, 0.21404114, 1]),
        ("255 0 128", [1, 0, 0.21586050, 1]),
        ("1.0000002 0 0", [1, 0, 0, 1]),
        ("1 0 1 0", [0, 1, 0, 1]),  # w, then red, green and blue
        ("0.5 1 0 0.25", [0.21404114, 1, 0, 0.25]),
    ],
)
def test_colours_of_vertices(row: str, colour: list[float]) -> None:
    text = "".join(f"v {place} {row}\n" for place in ("0 0 0", "1 0 0", "0 1 0")) + "f 1 2 3\n"
    mesh = mesh_of(read_mesh("a.obj", text))
    assert mesh.colours is not None
    np.testing.assert_allclose(mesh.colours, [colour] * 3, atol=1e-6)


def test_vertices_without_a_colour_are_white_beside_others() -> None:
    mesh = mesh_of(read_mesh("a.obj", "v 0 0 0 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"))
    assert mesh.colours is not None
    np.testing.assert_array_equal(mesh.colours, [[0, 0, 0, 1], [1, 1, 1, 1], [1, 1, 1, 1]])


def test_the_weight_of_a_vertex_is_left_out() -> None:
    found = read_mesh("a.obj", SQUARE.replace("v 1 1 0", "v 1 1 0 2") + "f 1 2 3 4\n")
    assert mesh_of(found).colours is None
    assert area(found) == pytest.approx(1)
    assert "weights" in found.warnings[0]


# --- Parts -----------------------------------------------------------------------------------------------------------


def test_groups_name_parts_where_there_are_no_objects() -> None:
    faces = "f 1 2 3\n"
    assert named(read_mesh("a.obj", SQUARE + f"g left\n{faces}g right  side\n{faces}g left\n{faces}")) == ["left", "right side"]
    assert named(read_mesh("a.obj", SQUARE + f"o x\ng left\n{faces}g right\n{faces}")) == ["x"]


def test_points_and_lines_are_parts() -> None:
    found = read_mesh("a.obj", SQUARE + "o x\nf 1 2 3\nl 1 2 3\nl 4 1\np 1 -1\n")
    assert sorted(named(found)) == ["x", "x.lines", "x.points"]
    strokes = {part["name"]: found.meshes[part["mesh"]].strokes for part in found.parts}
    assert strokes["x"] is None
    assert strokes["x.lines"] is not None
    assert len(strokes["x.lines"]) == 3
    assert strokes["x.points"] is not None
    assert (strokes["x.points"][:, 0] == strokes["x.points"][:, 1]).all()


def test_vertices_alone_are_a_cloud_of_points() -> None:
    found = read_mesh("a.obj", "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\n")
    mesh = mesh_of(found)
    assert mesh.strokes is not None
    assert len(mesh.strokes) == 2
    assert mesh.colours is not None


def test_statements_that_cannot_be_drawn_are_named() -> None:
    found = read_mesh("a.obj", SQUARE + "f 1 2 3 4\ncurv 0 1 1 2\ncall other.obj\nlod 5\n")
    assert len(found.warnings) == 2
    assert "free-form" in "".join(found.warnings)
    assert "'call'" in "".join(found.warnings)


def test_absent_uvs_and_normals_are_dropped_for_their_faces_alone() -> None:
    found = read_mesh("a.obj", SQUARE + "vt 0 0\nf 1/1 2/1 3/1\nf 1/2 3/1 4/1\n")
    assert [mesh.uvs is None for mesh in found.meshes] == [False, True]
    assert "line 7: 'vt' index out of range: the file has 1" in found.warnings[0]


# --- Size ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("statement", ["o x{}", "g x{}", "usemtl x{}"])
def test_time_grows_with_the_number_of_parts(statement: str) -> None:
    def seconds(count: int) -> float:
        text = SQUARE + "".join(f"{statement.format(k)}\nf 1 2 3\n" for k in range(count))
        before = time.process_time()
        assert len(read_mesh("a.obj", text).parts) == count
        return time.process_time() - before

    seconds(10)
    assert seconds(800) < 20 * seconds(200)


def test_a_switch_back_to_a_material_makes_no_part() -> None:
    text = SQUARE + "".join(f"usemtl m{k % 2}\nf 1 2 3\n" for k in range(20_000))
    before = time.process_time()
    found = read_mesh("a.obj", text)
    assert time.process_time() - before < 3
    assert [len(mesh.triangles) for mesh in found.meshes] == [10_000, 10_000]


def test_a_face_with_too_many_corners_is_refused() -> None:
    face = "f" + " 1 2 3 4" * (1 << 18) + " 1\n"
    with pytest.raises(AssetError, match="line 5: a face has 1,048,577 corners"):
        read_mesh("a.obj", SQUARE + face)
    zigzag = "".join(f"v {k} {k % 2 + (k * k) / 1e9} 0\n" for k in range(10_002))
    with pytest.raises(AssetError, match=r"line 10003: .*not convex"):
        read_mesh("a.obj", zigzag + "f " + " ".join(map(str, range(1, 10_003))) + "\n")


def test_a_line_that_never_ends_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(obj_text, "PIECE", 100)
    monkeypatch.setattr(obj_text, "LONGEST_LINE", 1000)
    for text in ("f" + " 1" * 2000, "f 1 \\\n" * 2000, "#" * 5000):
        with pytest.raises(AssetError, match="a line after line 1 has more than 1,000 bytes"):
            read_mesh("a.obj", text)


# --- Material files --------------------------------------------------------------------------------------------------


def test_the_only_material_needs_no_usemtl(tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_text("newmtl one\nKd 1 0 0\n")
    found = read_mesh("a.obj", SQUARE + "mtllib a.mtl\nf 1 2 3\n", tmp_path)
    assert found.parts[0]["material"]["kd"] == [1, 0, 0]
    (tmp_path / "a.mtl").write_text("newmtl one\nKd 1 0 0\nnewmtl two\n")
    found = read_mesh("a.obj", SQUARE + "mtllib a.mtl\nf 1 2 3\n", tmp_path)
    assert found.parts[0]["material"] is None
    assert "uses none of its 2 materials" in found.warnings[0]


def test_names_of_materials_and_their_files(tmp_path: Path) -> None:
    (tmp_path / "one file.mtl").write_text("newmtl\tA  b\t \nKd 1 0 0\n")
    (tmp_path / "two.mtl").write_text("newmtl c\nKd 0 1 0\nnewmtl unused\nKd x\nmap_Kd gone.png\n")
    text = f"usemtl A b\n{SQUARE}f 1 2 3\nusemtl c\nf 1 2 3\nusemtl d\nf 1 2 3\nmtllib one file.mtl\nmtllib two.mtl\n"
    found = read_mesh("a.obj", text, tmp_path)
    kd = {part["name"]: (part["material"] or {}).get("kd") for part in found.parts}
    assert kd == {"A b": [1, 0, 0], "c": [0, 1, 0], "d": None}
    assert found.warnings == ["a.obj: material 'd': in no material file; drawn without it"]
