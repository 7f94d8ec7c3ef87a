"""OFF files: the forms of the header, one number a line, and colours of vertices and faces."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.mesh_contents import area, colours, complaint, corners, mesh_of, places, read_mesh

from glshade.errors import AssetError
from glshade.mesh.reading.contents import Contents

SQUARE = "0 0 0\n2 0 0\n2 1 0\n0 1 0\n"
GOOD = f"OFF\n4 1 0\n{SQUARE}4 0 1 2 3\n"
HALF_GREY = ((0.5 + 0.055) / 1.055) ** 2.4


def contents(data: bytes | str) -> Contents:
    return read_mesh("a.off", data)


@pytest.mark.parametrize(
    "text",
    [
        GOOD,
        GOOD.replace("OFF\n", "OFF "),
        GOOD.replace("OFF\n", "OFF"),
        GOOD.replace("OFF", "off"),
        GOOD.replace("OFF\n", ""),
        GOOD.replace("4 1 0", "4 1"),
        GOOD.replace("OFF\n4 1 0", "OFF 4 1"),
        "\ufeff" + GOOD,
        "# a comment\n\n" + GOOD.replace("2 1 0", "2 1 0 # 7 8 9"),
        GOOD.replace(" ", "\n"),
        GOOD.replace("\n", "\r\n"),
        GOOD.replace("\n", "\r"),
        GOOD.replace("\n", " ").replace("OFF ", "OFF\n"),
        GOOD.replace(" ", "   \t"),
        GOOD + "# the end \xe9",
        GOOD.replace("2 0 0", "2.000 0e0 -0.0"),
    ],
)
def test_the_same_square_in_all_forms(text: str) -> None:
    found = contents(text)
    assert found.warnings == []
    assert area(found) == 2


def test_comments_in_latin_1() -> None:
    assert area(contents(GOOD.replace("OFF", "OFF # gr\xfcn").encode("latin-1"))) == 2


@pytest.mark.parametrize(
    ("keyword", "rest", "linear"),
    [
        ("COFF", "255 0 127.5 255", [1, 0, HALF_GREY, 1]),
        ("COFF", "1 0 0.5 0.25", [1, 0, HALF_GREY, 0.25]),
        ("COFF", "255 0 0", [1, 0, 0, 1]),
        ("COFF", "1 0 0 1", [1, 0, 0, 1]),
        ("OFF", "255 0 0 51", [1, 0, 0, 0.2]),
        ("CNOFF", "0 0 -1 1 0 0 1", [1, 0, 0, 1]),
        ("NCOFF", "255 0 0 255 0 0 -1", [1, 0, 0, 1]),
        ("STCNOFF", "0 0 -1 1 0 0 1 0.5 0.25", [1, 0, 0, 1]),
    ],
)
@pytest.mark.parametrize("one_a_line", [False, True])
def test_colours_normals_and_uvs_of_vertices(keyword: str, rest: str, linear: list[float], one_a_line: bool) -> None:
    text = f"{keyword}\n4 1 0\n{SQUARE}4 0 1 2 3\n".replace(" 0\n", f" 0 {rest}\n").replace(f"4 1 0 {rest}", "4 1 0")
    if one_a_line:
        if keyword == "OFF" or len(rest.split()) == 3:
            return  # nothing tells that each vertex has a colour, or that it has no alpha
        text = text.replace(" ", "\n")
    found = contents(text)
    assert area(found) == 2
    np.testing.assert_allclose(colours(found).reshape(-1, 4), [linear] * 6, atol=1e-6)
    mesh = mesh_of(found)
    assert (mesh.normals is not None) == ("N" in keyword)
    if mesh.normals is not None:
        np.testing.assert_array_equal(mesh.normals, [[0, 0, -1]] * 4)
    assert (mesh.uvs is not None) == ("ST" in keyword)
    if mesh.uvs is not None:
        np.testing.assert_array_equal(mesh.uvs, [[0.5, 0.25]] * 4)


def test_numbers_that_are_no_colours_are_told() -> None:
    found = contents(GOOD.replace(" 0\n", " 0 0 -3 7\n").replace("4 1 0 0 -3 7", "4 1 0"))
    assert area(found) == 2
    assert found.warnings == ["a.off: its vertices have 6 numbers, more than its header announces; drawn without the last"]


@pytest.mark.parametrize(
    ("first", "second", "linear"),
    [
        ("255 0 0", "0 0 255", ([1, 0, 0, 1], [0, 0, 1, 1])),
        ("1.0 0.0 0.5", "0 0 1 0.5", ([1, 0, HALF_GREY, 1], [0, 0, 1, 0.5])),
        ("1 0 0", "0 0 1", ([1, 0, 0, 1], [0, 0, 1, 1])),
        ("255 0 0 51", "", ([1, 0, 0, 0.2], [1, 1, 1, 1])),
        ("255 0 0", "0.5 0.5 0.5", ([1, 0, 0, 1], [HALF_GREY, HALF_GREY, HALF_GREY, 1])),
    ],
)
def test_colours_of_faces(first: str, second: str, linear: tuple[list[float], list[float]]) -> None:
    found = contents(f"OFF\n5 2 0\n{SQUARE}1 3 0\n4 0 1 2 3 {first}\n3 3 2 4 {second}\n")
    upper = corners(found)[:, :, 1].max(axis=1) > 1
    assert upper.tolist().count(True) == 1
    for chosen, expected in ((~upper, linear[0]), (upper, linear[1])):
        drawn = colours(found)[chosen].reshape(-1, 4)
        np.testing.assert_allclose(drawn, [expected] * len(drawn), atol=1e-6)


def test_an_index_of_a_colour_table_is_told() -> None:
    found = contents(GOOD.replace("4 0 1 2 3", "4 0 1 2 3 7"))
    assert mesh_of(found).colours is None
    assert found.warnings == ["a.off: its faces name colours of a table that the file does not hold; drawn without them"]


def test_a_file_without_faces_becomes_points_and_short_faces_become_lines_and_points() -> None:
    points = mesh_of(contents(f"OFF 4 0 0\n{SQUARE}")).strokes
    assert points is not None
    assert len(points) == 4
    found = contents(f"OFF 4 3 0\n{SQUARE}3 0 1 2\n2 2 3\n1 0\n")
    assert [part["name"] for part in found.parts] == ["a", "a.lines", "a.points"]
    line = mesh_of(found, 1)
    assert line.strokes is not None
    np.testing.assert_array_equal(places(line)[line.strokes[0]], [[2, 1, 0], [0, 1, 0]])


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ("garbage", "does not begin with 'OFF'"),
        ("4OFF\n1 1 0\n0 0 0 1\n1 0\n", "is a file of the kind 4OFF"),
        ("C4nOFF\n3\n1 1 0\n0 0 0\n1 0\n", "is a file of the kind C4nOFF"),
        (b"OFF BINARY\n\0\0\0\1\0\0\0\1", "is a binary OFF file, which is not supported; save it as text"),
        ("OFF\n", "it has no counts of vertices and faces"),
        ("OFF\n4000000000 4000000000 0\n0 0 0\n", "announces 4,000,000,000 vertices and 4,000,000,000 faces, which need more"),
        (GOOD.replace("4 1 0", "-4 1 0"), "has -4 as the number"),
        (GOOD.replace("4 1 0", "0 1 0"), "holds no vertices"),
        (GOOD.replace("2 1 0", "2 one 0"), "line 5: 'one' is not a number"),
        (GOOD.replace("0 1 2 3", "0 1 2 9"), "face 0: vertex index 9 is out of range: the file has 4"),
        (GOOD.replace("0 1 2 3", "0 1 2 -1"), "face 0: vertex index -1 is out of range"),
        (GOOD.replace("4 0 1 2 3", "5 0 1 2 3"), "face 0 cannot have 5 corners; is it truncated"),
        (GOOD.replace("4 0 1 2 3", "4 0 1"), "face 0 cannot have 4 corners; is it truncated"),
        (GOOD.replace("4 1 0", "4 3 0"), "ends before face 1"),
    ],
)
def test_a_bad_file_says_what_is_wrong_and_where(data: bytes | str, message: str) -> None:
    with pytest.raises(AssetError, match=f"^a.off: .*{message}"):
        contents(data)


@given(st.integers(0, 1 << 30), st.integers(0, 255), st.booleans())
@settings(max_examples=60, deadline=None)
def test_a_changed_byte_gives_a_mesh_or_one_line(position: int, value: int, one_a_line: bool) -> None:
    text = f"CNOFF\n4 2 0\n{SQUARE}4 0 1 2 3 255 0 0\n3 0 1 2\n".replace(" 0\n", " 0 0 0 1 0.5 0.5 0.5 1\n", 1)
    text = text.replace(" 0\n", " 0 0 0 1 0.5 0.5 0.5 1\n").replace("4 2 0 0 0 1 0.5 0.5 0.5 1", "4 2 0")
    data = bytearray((text.replace(" ", "\n") if one_a_line else text).encode())
    data[position % len(data)] = value
    for mutated in (bytes(data), bytes(data[: position % len(data)])):
        assert "do not fit together" not in complaint("a.off", mutated)
