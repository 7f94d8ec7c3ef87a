"""STL files as text and in binary form, with what programs add to them and leave out."""

from __future__ import annotations

import importlib
import struct
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.mesh_contents import area, colours, complaint, corners, mesh_of, read_mesh

from glshade.errors import AssetError
from glshade.mesh.reading.contents import Contents

# Two triangles with the areas 1/2 and 2.
TRIANGLES = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[2, 0, 0], [4, 0, 0], [2, 2, 0]]], dtype=np.float32)
TEXT = """solid {name}
facet normal 0 0 1
  outer loop
    vertex 0 0 0
    vertex 1 0 0
    vertex 0 1 0
  endloop
endfacet
endsolid {name}
"""


def contents(data: bytes | str) -> Contents:
    return read_mesh("a.stl", data)


def binary(header: bytes = b"", attributes: tuple[int, ...] = (0, 0), count: int = 2) -> bytes:
    rows = np.zeros(2, dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    rows["corners"], rows["attribute"] = TRIANGLES, attributes
    return header.ljust(80, b" ") + struct.pack("<I", count) + rows.tobytes()


def by_place(found: Contents) -> list[Any]:
    """Returns the colours of the first and of the second triangle of TRIANGLES."""
    order = corners(found)[:, 0, 0].argsort()
    return [colours(found)[k] for k in order]


# --- binary ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("data", "expected", "warning"),
    [
        (binary(b"solid, says the header"), 2.5, None),
        (binary() + b"\0" * 13, 2.5, "13 bytes after its 2 triangles are not read"),
        (binary()[:-10], 0.5, "is truncated: it announces 2 triangles and holds 1; drawn with those"),
        (binary(b"solid")[:-50], 0.5, "is truncated: it announces 2 triangles and holds 1; drawn with those"),
        (binary(count=0), 2.5, "announces no triangles and holds 2; drawn with those"),
        (binary(count=1), 0.5, "50 bytes after its 1 triangles are not read"),
        (binary(count=4_000_000_000), 2.5, "is truncated: it announces 4,000,000,000 triangles and holds 2"),
    ],
)
def test_the_triangles_that_a_binary_file_holds_are_drawn(data: bytes, expected: float, warning: str | None) -> None:
    found = contents(data)
    assert area(found) == expected
    assert [line.startswith(f"a.stl: {warning}") for line in found.warnings] == ([True] if warning else [])


def test_a_degenerate_triangle_does_not_matter() -> None:
    data = bytearray(binary())
    data[84 + 12 : 84 + 48] = data[84 + 12 : 84 + 24] * 3
    assert area(contents(bytes(data))) == 2


RED, BLUE = 31, 31 << 10


def test_colours_of_viscam() -> None:
    # The lowest bits are blue, and the highest bit says that the triangle has a colour.
    found = by_place(contents(binary(attributes=(0x8000 | RED, 5))))
    np.testing.assert_allclose(found[0], [[0, 0, 1, 1]] * 3)
    np.testing.assert_allclose(found[1], [[1, 1, 1, 1]] * 3)


def test_colours_of_magics() -> None:
    # The lowest bits are red, and the highest bit says that the triangle has the colour of the header.
    found = by_place(contents(binary(b"COLOR=\x00\xff\x80\xff", (0x8000, RED))))
    np.testing.assert_allclose(found[0], [[0, 1, ((128 / 255 + 0.055) / 1.055) ** 2.4, 1]] * 3, atol=1e-6)
    np.testing.assert_allclose(found[1], [[1, 0, 0, 1]] * 3)
    plain = by_place(contents(binary(b"COLOR=\x00\x00\xff\xff", (0, 0))))
    np.testing.assert_allclose(plain, [[[0, 0, 1, 1]] * 3] * 2)


def test_five_bits_are_encoded_as_in_pictures() -> None:
    grey = 15 | 15 << 5 | 15 << 10
    found = by_place(contents(binary(attributes=(0x8000 | grey, 0x8000))))
    np.testing.assert_allclose(found[0][:, :3], ((15 / 31 + 0.055) / 1.055) ** 2.4, rtol=1e-6)
    np.testing.assert_allclose(found[1][:, :3], 0)


def test_a_file_without_marked_attributes_has_no_colours() -> None:
    assert mesh_of(contents(binary(attributes=(7, 0x7FFF)))).colours is None


# --- text ------------------------------------------------------------------------------------------------------------------


def test_each_solid_is_a_part() -> None:
    second = TEXT.format(name="caf\xe9 2").replace("vertex 0 1", "vertex 0 3")
    found = contents((TEXT.format(name="one") + second + TEXT.format(name="")).encode("latin-1"))
    assert [part["name"] for part in found.parts] == ["one", "caf\xe9 2", "a"]
    assert [len(corners(found, part)) for part in range(3)] == [1, 1, 1]
    assert area(found) == 2.5


@pytest.mark.parametrize(
    "change",
    [
        str.upper,
        lambda text: text.replace("\n", "\r"),
        lambda text: text.replace("\n", "\r\n"),
        lambda text: f"\ufeff{text}",
        lambda text: text.replace(" ", " \t  "),
        lambda text: text.replace("\n", " "),
        lambda text: text.replace("facet normal", "facet\tnormal\n"),
        lambda text: text.replace("0 0 1", "nan nan -nan(ind)"),
        lambda text: text.replace("facet normal 0 0 1", "facet"),
        lambda text: "\n" + text.partition("\n")[2],
        lambda text: text.rpartition("endsolid")[0],
        lambda text: text.replace("vertex 1 0 0", "vertex 1.0E0 0.0e-3 +0."),
        lambda text: text.replace("name", "facet of a vertex, 7 solid"),
    ],
)
def test_text_in_other_clothes_is_the_same_triangle(change: Any) -> None:
    found = contents(change(TEXT.format(name="name")))
    assert found.warnings == []
    np.testing.assert_array_equal(corners(found)[0], TRIANGLES[0])


def test_text_that_ends_early_is_drawn_as_far_as_it_goes() -> None:
    whole = TEXT.format(name="a") + TEXT.format(name="b")
    found = contents(whole[: whole.rindex("vertex") + 8])
    assert area(found) == 0.5
    assert found.warnings == ["a.stl: ends within a triangle; drawn without it"]


def test_facets_with_more_or_fewer_than_three_corners() -> None:
    four = TEXT.format(name="a").replace("vertex 1 0 0", "vertex 1 0 0\nvertex 1 1 0")
    two = TEXT.format(name="b").replace("vertex 1 0 0", "")
    # Together they have as many corners as two triangles.
    for text in (four + two, four.partition("endsolid")[0] + two.partition("\n")[2]):
        found = contents(text)
        assert area(found) == 1
        assert found.warnings == ["a.stl: 1 facets have fewer than 3 corners; drawn without them"]


def test_text_that_is_read_in_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    text = "".join(TEXT.format(name=name).replace("vertex 1 0", f"vertex {k + 1} 0") for k, name in enumerate("abab"))
    whole = contents(text)
    monkeypatch.setattr(importlib.import_module("glshade.mesh.formats.stl"), "_BLOCK", 100)
    one = text.replace("endsolid a\nsolid b\n", "").replace("endsolid b\nsolid a\n", "")
    found = contents(one)
    assert len(found.parts) == 1
    assert sorted(corners(found)[:, :, 0].max(axis=1)) == [1, 2, 3, 4]
    assert area(found) == area(whole) == 5
    with pytest.raises(AssetError, match="line 19: 'O' is not a number"):
        contents(one.replace("vertex 3 0 0", "vertex 3 O 0"))


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ("garbage", "neither text with facets nor a binary file"),
        ("<html>" + "not found " * 50, "neither text with facets nor a binary file"),
        ("solid a\nendsolid a\n", "holds no triangles"),
        (b"\0" * 84, "holds no triangles"),
        (b"\0" * 60, "a binary file begins with 84 bytes, and this has 60"),
        (b"\0" * 80 + struct.pack("<I", 7) + b"\0" * 40, "holds no triangles"),
        (TEXT.replace("1 0 0", "1 O 0"), "line 5: 'O' is not a number"),
        (TEXT.replace("1 0 0", "1 0"), "line 7: a vertex needs three numbers"),
    ],
)
def test_a_bad_file_says_what_is_wrong_and_where(data: bytes | str, message: str) -> None:
    with pytest.raises(AssetError, match=f"^a.stl: .*{message}"):
        contents(data)


@given(st.integers(0, 1 << 30), st.integers(0, 255), st.booleans())
@settings(max_examples=60, deadline=None)
def test_a_changed_byte_gives_a_mesh_or_one_line(position: int, value: int, text: bool) -> None:
    data = bytearray(TEXT.encode() if text else binary(b"solid"))
    data[position % len(data)] = value
    for mutated in (bytes(data), bytes(data[: position % len(data)])):
        assert "do not fit together" not in complaint("a.stl", mutated)
