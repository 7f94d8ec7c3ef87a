"""PLY files in all their forms: each test writes a small file, reads it, and compares what is drawn with what was written."""

from __future__ import annotations

import struct
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.mesh_contents import PNG, area, colours, complaint, corners, mesh_of, places, read_mesh

from glshade.errors import AssetError
from glshade.mesh.reading.contents import Contents

SQUARE = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [1, 3, 0]], dtype=np.float64)
XYZ = "property float x\nproperty float y\nproperty float z\n"
INDICES = "property list uchar int vertex_indices\n"


def contents(data: bytes | str, folder: Path = Path("/nowhere")) -> Contents:
    """Returns what the reader finds in a PLY file with this data."""
    return read_mesh("a.ply", data, folder)


def header(form: str, vertices: int, rest: str) -> str:
    return f"ply\nformat {form} 1.0\nelement vertex {vertices}\n{rest}end_header\n"


def binary(order: str, faces: list[list[int]]) -> bytes:
    """Returns a binary file with the vertices of SQUARE and these polygons."""
    form = "binary_little_endian" if order == "<" else "binary_big_endian"
    head = header(form, len(SQUARE), f"{XYZ}element face {len(faces)}\n{INDICES}")
    rows = b"".join(struct.pack(f"{order}B{len(face)}i", len(face), *face) for face in faces)
    return head.encode() + SQUARE.astype(f"{order}f4").tobytes() + rows


@pytest.mark.parametrize("order", ["<", ">"])
def test_triangles_and_quads_of_a_binary_file_are_drawn_together(order: str) -> None:
    found = contents(binary(order, [[0, 1, 2, 3], [3, 2, 4]]))
    assert area(found) == 4
    assert len(corners(found)) == 3


@given(st.lists(st.integers(0, 8), min_size=1, max_size=30), st.sampled_from("<>"), st.booleans())
@settings(max_examples=30, deadline=None)
def test_lists_of_any_lengths_come_back_in_binary_and_in_text(lengths: list[int], order: str, text: bool) -> None:
    generator = np.random.default_rng(len(lengths))
    # Polygons with all corners on a circle are convex, so that each gives a fan.
    angle = np.linspace(0, 2 * np.pi, 8, endpoint=False)
    circle = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(8)]).astype(np.float32)
    faces = [np.sort(generator.permutation(8)[:length]) for length in lengths]
    form = "ascii" if text else "binary_little_endian" if order == "<" else "binary_big_endian"
    head = header(form, 8, f"{XYZ}element face {len(faces)}\nproperty short tag\n{INDICES}property float weight\n")
    if text:
        rows = "\n".join(f"7 {len(face)} {' '.join(map(str, face))} 0.5" for face in faces)
        points = "\n".join(" ".join(repr(float(x)) for x in point) for point in circle)
        data = f"{head}{points}\n{rows}\n".encode()
    else:
        pack = [struct.pack(f"{order}hB{len(face)}if", 7, len(face), *face, 0.5) for face in faces]
        data = head.encode() + circle.astype(f"{order}f4").tobytes() + b"".join(pack)
    expected = [circle[face[[0, k, k + 1]]] for face in faces for k in range(1, len(face) - 1)]
    if not expected:
        assert contents(data).meshes[0].strokes is not None
        return
    drawn = corners(contents(data))
    assert len(drawn) == len(expected)

    def ordered(triangles: Any) -> Any:
        return sorted(np.sort(triangle.astype(np.float64).round(5), axis=0).tolist() for triangle in np.asarray(triangles))

    assert ordered(drawn) == ordered(expected)


def test_a_concave_polygon_is_cut_within_its_outline() -> None:
    arrow = "0 0 0\n4 0 0\n1 1 0\n0 4 0\n"
    for face in ("4 0 1 2 3", "4 1 2 3 0", "4 2 3 0 1"):
        found = contents(header("ascii", 4, f"{XYZ}element face 1\n{INDICES}") + arrow + face)
        areas = [float(np.cross(b - a, c - a)[2]) for a, b, c in corners(found)]
        assert min(areas) >= 0
        assert sum(areas) == pytest.approx(8)


def test_elements_in_any_order_with_unknown_ones_between_them() -> None:
    rest = f"element camera 1\nproperty list uint8 float64 view\nproperty int16 id\nelement face 1\n{INDICES}"
    rest += f"property list uchar float junk\nelement vertex 4\nproperty list uchar ushort links\n{XYZ}element nothing 5\n"
    data = f"ply\nformat binary_little_endian 1.0\n{rest}end_header\n".encode()
    data += struct.pack("<B3dh", 3, 1.0, 2.0, 3.0, 4) + struct.pack("<B4iBf", 4, 0, 1, 2, 3, 1, 9.0)
    for index, point in enumerate(SQUARE[:4]):
        data += struct.pack(f"<B{index}H3f", index, *range(index), *point)
    assert area(contents(data)) == 2


@pytest.mark.parametrize("kind", ["int64", "uint8", "uint16_t", "double", "Float32", "half"])
def test_types_of_all_sizes(kind: str) -> None:
    code = {"int64": "q", "uint8": "B", "uint16_t": "H", "double": "d", "Float32": "f", "half": "e"}[kind]
    head = header("binary_big_endian", 3, f"{XYZ}element face 1\nproperty list {kind} {kind} vertex_index\n")
    data = head.encode() + SQUARE[:3].astype(">f4").tobytes() + struct.pack(f">4{code}", 3, 0, 1, 2)
    assert area(contents(data)) == 1


def test_odd_whitespace_line_ends_and_latin_1_comments() -> None:
    head = header("ascii", 3, f"comment gr\xfcn\nobj_info  \xe9t\xe9\n{XYZ}element face 1\n{INDICES}")
    body = "0 0\n0\n\n 2 0 0 2\t1\r0\r\n  3   0 1\n 2  \n"
    for end in ("\n", "\r\n", "\r"):
        assert area(contents(head.replace("\n", end).encode("latin-1") + body.encode())) == 1


def test_a_binary_file_may_begin_with_the_byte_of_a_line_end() -> None:
    # After "\r" alone, which ends the lines of this header, the byte "\n" belongs to the first number.
    head = header("binary_little_endian", 3, f"element face 1\n{INDICES}").replace("element face", f"{XYZ}element face")
    first = struct.unpack("<f", b"\n\0\x80\x3f")[0]
    data = (
        head.replace("\n", "\r").encode() + struct.pack("<9f", first, 0, 0, 2, 0, 0, 2, 1, 0) + struct.pack("<B3i", 3, 0, 1, 2)
    )
    assert corners(contents(data)).min(axis=(0, 1))[0] == np.float32(first)


def test_triangle_strips_keep_the_orientation_of_their_first_triangle() -> None:
    points = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n1 2 0\n"
    rest = "element tristrips 1\nproperty list int int vertex_indices\n"
    for strip, expected in (("6 0 1 2 3 4 5", 2.0), ("7 0 1 2 3 -1 4 5", 1.0), ("8 0 1 2 -1 2 3 4 5", 1.5)):
        found = contents(header("ascii", 6, XYZ + rest) + points + strip)
        a, b, c = np.moveaxis(corners(found), 1, 0)
        turned = np.cross(b - a, c - a)[:, 2]
        assert (turned > 0).all()
        assert turned.sum() / 2 == pytest.approx(expected)


# --- colours ---------------------------------------------------------------------------------------------------------------

HALF_GREY = ((0.5 + 0.055) / 1.055) ** 2.4


@pytest.mark.parametrize(
    ("kind", "written", "linear"),
    [
        ("uchar", "255 0 127.5", [1, 0, HALF_GREY]),
        ("int", "255 0 0", [1, 0, 0]),
        ("uint16", "65535 0 32767.5", [1, 0, HALF_GREY]),
        ("float", "1 0 0.5", [1, 0, 0.5]),
        ("double", "0.5 0.25 0", [0.5, 0.25, 0]),
        ("float", "255 0 127.5", [1, 0, HALF_GREY]),
    ],
)
@pytest.mark.parametrize("prefix", ["", "diffuse_"])
def test_colours_of_vertices(kind: str, written: str, linear: list[float], prefix: str) -> None:
    names = "".join(f"property {kind} {prefix}{name}\n" for name in ("red", "green", "blue"))
    rows = "".join(f"{x} {y} {z} {written}\n" for x, y, z in SQUARE[:3])
    found = contents(header("ascii", 3, f"{XYZ}{names}element face 1\n{INDICES}") + rows + "3 0 1 2")
    np.testing.assert_allclose(colours(found)[0], [[*linear, 1]] * 3, atol=1e-6)


def test_colours_with_alpha() -> None:
    names = "".join(f"property uchar {name}\n" for name in ("red", "green", "blue", "alpha"))
    rows = "".join(f"{x} {y} {z} 255 0 0 51\n" for x, y, z in SQUARE[:3])
    found = contents(header("ascii", 3, f"{XYZ}{names}element face 1\n{INDICES}") + rows + "3 0 1 2")
    np.testing.assert_allclose(colours(found)[0], [[1, 0, 0, 0.2]] * 3, atol=1e-6)


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian"])
def test_colours_of_faces_are_drawn(form: str) -> None:
    names = "".join(f"property uchar {name}\n" for name in ("red", "green", "blue"))
    head = header(form, 5, f"{XYZ}element face 2\n{INDICES}{names}")
    if form == "ascii":
        rows = "".join(f"{x} {y} {z}\n" for x, y, z in SQUARE)
        data = f"{head}{rows}4 0 1 2 3 255 0 0\n3 3 2 4 0 0 255\n".encode()
    else:
        data = head.encode() + SQUARE.astype("<f4").tobytes()
        data += struct.pack("<B4i3B", 4, 0, 1, 2, 3, 255, 0, 0) + struct.pack("<B3i3B", 3, 3, 2, 4, 0, 0, 255)
    found = contents(data)
    is_upper = corners(found)[:, :, 1].max(axis=1) > 1
    for upper, colour in ((False, [1, 0, 0, 1]), (True, [0, 0, 1, 1])):
        np.testing.assert_allclose(colours(found)[is_upper == upper].reshape(-1, 4), [colour] * (3 if upper else 6))


# --- textures --------------------------------------------------------------------------------------------------------------


def textured(comments: str, faces: str, extra: str = "property int texnumber\n") -> str:
    rows = "".join(f"{x} {y} {z}\n" for x, y, z in SQUARE)
    count = faces.count("\n")
    uvs = "property list uchar float texcoord\n"
    return header("ascii", 5, f"{comments}{XYZ}element face {count}\n{INDICES}{uvs}{extra}") + rows + faces


FACES = "3 0 1 2 6 0 0 1 0 1 1 {}\n3 0 2 3 6 0 0 1 1 0 1 {}\n3 3 2 4 6 0 0.5 1 0.5 0.5 1 {}\n"
NAMES = "comment TextureFile one.png\ncomment TextureFile two 2.png\n"


def test_each_face_shows_the_texture_of_its_number(tmp_path: Path) -> None:
    for name in ("one.png", "two 2.png"):
        (tmp_path / name).write_bytes(PNG)
    found = contents(textured(NAMES, FACES.format(0, 1, 0)), tmp_path)
    shown = {Path(part["material"]["kd"]["texture"]).name: corners(found, k) for k, part in enumerate(found.parts)}
    assert {name: len(triangles) for name, triangles in shown.items()} == {"one.png": 2, "two 2.png": 1}
    np.testing.assert_array_equal(np.sort(shown["two 2.png"][0], axis=0), np.sort(SQUARE[[0, 2, 3]], axis=0))
    two = next(k for k, part in enumerate(found.parts) if "two" in part["material"]["kd"]["texture"])
    mesh = found.meshes[found.parts[two]["mesh"]]
    assert mesh.uvs is not None
    np.testing.assert_array_equal(mesh.uvs, places(mesh)[:, :2] / [2, 1])


def test_a_face_without_a_texture_or_uvs_is_drawn_plain_with_a_warning(tmp_path: Path) -> None:
    (tmp_path / "one.png").write_bytes(PNG)
    found = contents(textured(NAMES.split("\n")[0] + "\n", FACES.format(0, 7, -1)), tmp_path)
    assert sorted((part["material"] is None, len(corners(found, k))) for k, part in enumerate(found.parts)) == [
        (False, 1),
        (True, 2),
    ]
    assert found.warnings == ["a.ply: 1 triangles show a texture that the file does not name; drawn without it"]
    without = FACES.format(0, 0, 0).replace("6 0 0 1 1 0 1", "0")
    found = contents(textured(NAMES.split("\n")[0] + "\n", without), tmp_path)
    assert sorted((part["material"] is None, len(corners(found, k))) for k, part in enumerate(found.parts)) == [
        (False, 2),
        (True, 1),
    ]
    assert "1 faces have no texture coordinates" in found.warnings[0]


def test_a_texture_takes_the_place_of_colours(tmp_path: Path) -> None:
    grey = "property uchar red\nproperty uchar green\nproperty uchar blue\n"
    text = textured("comment TextureFile one.png\n", FACES.format("9 9 9", "9 9 9", "9 9 9"), grey)
    for present in (False, True):
        if present:
            (tmp_path / "one.png").write_bytes(PNG)
        found = contents(text, tmp_path)
        assert (found.parts[0]["material"] is not None) == present
        assert (mesh_of(found).colours is None) == present
        assert len(found.warnings) == 1
    assert found.warnings == ["a.ply: has textures and colours; drawn with the textures where there are some"]


def test_numbers_that_the_header_does_not_declare_are_left_out_at_the_ends_of_lines() -> None:
    rows = "".join(f"{x} {y} {z} 9 9\n" for x, y, z in SQUARE)
    found = contents(header("ascii", 5, f"{XYZ}element face 2\n{INDICES}") + f"{rows}4 0 1 2 3 255 0 0\n3 3 2 4\n")
    assert area(found) == 4
    assert found.warnings == ["a.ply: its lines have more numbers than the header declares; drawn without them"]


def test_a_texture_without_uvs_is_told(tmp_path: Path) -> None:
    (tmp_path / "one.png").write_bytes(PNG)
    found = contents(
        header("ascii", 3, f"comment TextureFile one.png\n{XYZ}element face 1\n{INDICES}") + "0 0 0 1 0 0 0 1 0 3 0 1 2",
        tmp_path,
    )
    assert found.parts[0]["material"] is None
    assert found.warnings == ["a.ply: names a texture, but has no texture coordinates; drawn without it"]


# --- points and lines ------------------------------------------------------------------------------------------------------


def test_a_file_without_faces_becomes_points() -> None:
    for rest in ("", f"element face 0\n{INDICES}"):
        mesh = contents(header("ascii", 2, XYZ + rest) + "0 0 0\n1 2 3").meshes[0]
        assert mesh.strokes is not None
        assert mesh.strokes.tolist() == [[0, 0], [1, 1]]


def test_edges_are_drawn_where_they_are_no_sides_of_faces() -> None:
    rest = f"{XYZ}element face 1\n{INDICES}element edge 3\nproperty int vertex1\nproperty int vertex2\n"
    rows = "".join(f"{x} {y} {z}\n" for x, y, z in SQUARE)
    found = contents(header("ascii", 5, rest) + rows + "3 0 1 2\n1 0\n2 4\n2 0\n")
    assert [part["name"] for part in found.parts] == ["a", "a.lines"]
    mesh = found.meshes[1]
    assert mesh.strokes is not None
    np.testing.assert_array_equal(places(mesh)[mesh.strokes[0]], SQUARE[[2, 4]])


# --- bad files -------------------------------------------------------------------------------------------------------------

GOOD = header("ascii", 3, f"{XYZ}element face 1\n{INDICES}") + "0 0 0\n2 0 0\n2 1 0\n3 0 1 2\n"


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ("not a ply", "does not begin with the line 'ply'"),
        ("ply\nformat ascii 1.0\nelement vertex 3\n", "no line 'end_header'; is the file truncated"),
        (GOOD.replace("ascii", "binary"), "line 2: the format 'binary' is unknown"),
        (GOOD.replace("format ascii 1.0\n", ""), "no line 'format'"),
        (GOOD.replace("vertex 3", "vertex three"), "line 3: 'element vertex three' is not an element"),
        (GOOD.replace("float y", "quad y"), "line 5: the type 'quad' is unknown"),
        (GOOD.replace("property float z\n", ""), "element vertex: has no property 'z'"),
        (GOOD.replace("vertex_indices", "corners"), "element face: has no list 'vertex_indices'"),
        (GOOD.replace("vertex 3", "vertex 4000000000"), "element vertex: its 4,000,000,000 rows need 12,000,000,000 numbers"),
        (GOOD.replace("face 1", "face 4000000000"), "element face: its 4,000,000,000 rows need 4,000,000,000 numbers"),
        (GOOD.replace("3 0 1 2", "3 0 1 9"), "element face, row 0: vertex index 9 is out of range: the file has 3"),
        (GOOD.replace("3 0 1 2", "3 0 1 -1"), "element face, row 0: vertex index -1 is out of range"),
        (GOOD.replace("3 0 1 2", "3 0 1"), "element face: the file ends in row 0 of 1"),
        (GOOD.replace("3 0 1 2", "-3 0 1 2"), "element face: row 0: a list cannot have -3 numbers"),
        (GOOD.replace("3 0 1 2", "3 0 1 1.5"), "element face: 1.5 is no vertex index"),
        (GOOD.replace("2 0 0", "2 zero 0"), "line 11: 'zero' is not a number"),
        (GOOD.replace("element vertex 3\n", ""), "line 3: the property .* belongs to no element"),
        (
            binary("<", [[0, 1, 2]]).replace(b"vertex 5", b"vertex 4000000000"),
            "need 48,000,000,000 bytes or more, but the file has",
        ),
        (binary("<", [[0, 1, 2], [1, 2, 3]])[:-1], "element face: the file ends in row 1 of 2"),
        (binary("<", [[0, 1, 2, 3], [1, 2, 3], [0, 1, 2]])[:-2], "element face: the file ends in row 2 of 3"),
    ],
)
def test_a_bad_file_says_what_is_wrong_and_where(data: bytes | str, message: str) -> None:
    with pytest.raises(AssetError, match=message) as caught:
        contents(data)
    assert str(caught.value).startswith("a.ply: ")
    assert "\n" not in str(caught.value)


@given(st.integers(0, 1 << 30), st.integers(0, 255), st.sampled_from("<>"))
@settings(max_examples=60, deadline=None)
def test_a_changed_byte_gives_a_mesh_or_one_line(position: int, value: int, order: str) -> None:
    data = bytearray(binary(order, [[0, 1, 2, 3], [3, 2, 4]]))
    data[position % len(data)] = value
    for mutated in (bytes(data), bytes(data[: position % len(data)])):
        assert "do not fit together" not in complaint("a.ply", mutated)


def test_numbers_after_the_last_element_are_told() -> None:
    found = contents(GOOD + "3 0 1 2\n")
    assert area(found) == 1
    assert found.warnings == ["a.ply: 4 numbers after its last element are not read"]


def test_a_header_with_a_broken_comment_or_another_last_line_end_is_read() -> None:
    broken = GOOD.replace("element vertex", "Created by a program, source file: \nelement vertex")
    found = contents(broken)
    assert area(found) == 1
    assert found.warnings == ["a.ply: line 3: 'Created by a program, source file: ' is no line of a PLY header; left out"]
    data = binary("<", [[0, 1, 2]]).replace(b"end_header\n", b"end_header\r\n")
    assert area(contents(data)) == 1


@pytest.mark.parametrize("star", [False, True])
def test_a_polygon_with_thousands_of_corners_is_cut_in_time(star: bool) -> None:
    count = 3000
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    radius = np.where(np.arange(count) % 2, 0.9, 1.0) if star else np.ones(count)
    outline = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(count)])
    x, y, _ = outline.T
    expected = float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) / 2)
    head = header("ascii", count, f"{XYZ}element face 1\nproperty list int int vertex_indices\n")
    rows = "".join(f"{x!r} {y!r} 0\n" for x, y, _ in outline.tolist())
    began = time.perf_counter()
    found = contents(f"{head}{rows}{count} {' '.join(map(str, range(count)))}\n")
    assert time.perf_counter() - began < 5  # a second on an idle machine, and other work may share it
    assert len(corners(found)) == count - 2
    assert area(found) == pytest.approx(expected, rel=1e-5)
