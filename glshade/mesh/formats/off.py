"""OFF: the Object File Format of Geomview, a list of vertices and a list of polygons, both with optional colours.

The format's description (Phillips et al., "OFF: Object File Format", geomview.org) gives colours as integers up to 255 or as
floats up to 1. Geomview shows both unchanged, so that they are sRGB-encoded.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from glshade.arrays import Array, Float64, Int64
from glshade.mesh.reading.colours import display_colours
from glshade.mesh.reading.faces import cut
from glshade.mesh.reading.file import MeshFile, text_of
from glshade.mesh.reading.number_text import numbers

# The keyword of the header. Its letters announce texture coordinates (ST), colours (C), normals (N), a fourth coordinate (4)
# and any number of coordinates (n). The keyword is optional, and a few programs write no space behind it.
_KEYWORD = re.compile(rb"\s*((?:ST|[CN4n]){0,5})(?:OFF|off)(?=[\s\d]|\Z)(\s+BINARY\b)?")


@dataclass(frozen=True)
class _Words:
    """The numbers of a file.

    values: (N,) the numbers.
    lines: (N,) the line of each, counted from 0.
    problem: a message about the first word that is no number; empty where there is none.
    """

    values: Float64
    lines: Int64
    problem: str


def read(file: MeshFile) -> None:
    """Adds the polygons of an OFF file, and the lines and points among them. Errors: AssetError, with the place."""
    head = _KEYWORD.match(file.data.removeprefix(b"\xef\xbb\xbf"))
    if head is not None and head[2]:
        raise file.fail("is a binary OFF file, which is not supported; save it as text")
    text = re.sub(rb"#[^\n]*", b"", text_of(file.data).encode("ascii", "replace"))
    keyword = _KEYWORD.match(text)
    if keyword is None and not re.match(rb"\s*\d", text):
        raise file.fail("is not a readable OFF file: it does not begin with 'OFF'")
    letters = keyword[1].decode() if keyword else ""
    if "4" in letters or "n" in letters:
        raise file.fail(f"is a file of the kind {letters}OFF, whose vertices do not have three coordinates; not supported")
    start = keyword.end() if keyword else 0
    words = _words(text[start:], text.count(b"\n", 0, start) + 1)
    at, vertex_count, face_count = _counts(file, words)
    arrays, at = _vertices(file, words, at, vertex_count, letters)
    _add_faces(file, words, at, face_count, arrays)


def _words(body: bytes, first_line: int) -> _Words:
    """Returns the numbers of the text behind the keyword."""
    values, problem = numbers(body, first_line)
    letters = np.frombuffer(body, np.uint8)
    is_space = (letters == 32) | ((letters >= 9) & (letters <= 13))
    starts = np.flatnonzero(~is_space & np.append(True, is_space[:-1]))[: len(values)]
    ends_of_lines = np.flatnonzero(letters == 10)
    return _Words(values, np.searchsorted(ends_of_lines, starts).astype(np.int64), problem)


def _counts(file: MeshFile, words: _Words) -> tuple[int, int, int]:
    """Returns the index of the first number of the vertices, and the numbers of vertices and faces. Errors: AssetError.

    The third count, that of edges, is not used, and some files lack it.
    """
    values, lines = words.values, words.lines
    if len(values) < 2:
        raise file.fail(words.problem or "is not a readable OFF file: it has no counts of vertices and faces")
    on_first_line = int(np.searchsorted(lines, lines[0], side="right"))
    size = 2 if on_first_line == 2 else 3
    for value in values[:2]:
        if value < 0 or value != np.floor(value):
            raise file.fail(f"has {value:g} as the number of its vertices or faces")
    # A vertex has at least three numbers, a face at least one.
    vertices, faces = float(values[0]), float(values[1])
    if 3 * vertices + faces > len(values) - size:
        announced = f"announces {vertices:,.0f} vertices and {faces:,.0f} faces, which need more numbers than it has"
        raise file.fail(f"{words.problem or announced}; is it truncated?")
    return size, int(vertices), int(faces)


def _vertices(file: MeshFile, words: _Words, at: int, count: int, letters: str) -> tuple[dict[str, Float64 | None], int]:
    """Returns the arrays of the vertices by their names in `MeshFile.build`, and the index of the first number after them.

    letters: the letters in front of "OFF". A vertex has its position, then the normal, colour and uv that they announce.
    Errors: AssetError.
    """
    if not count:
        raise file.fail("holds no vertices")
    colour, normal, uv = "C" in letters, 3 * ("N" in letters), 2 * ("ST" in letters)
    # Where all vertices have lines of their own, a line tells how many numbers a vertex has.
    width = int(np.searchsorted(words.lines, words.lines[at], side="right")) - at
    end = at + width * count
    if width < 3 + normal + 3 * colour + uv or end > len(words.values) or not _have_lines(words.lines[at:end], width):
        width = 3 + normal + 4 * colour + uv
        end = at + width * count
        if end > len(words.values):
            raise file.fail(words.problem or f"ends within its {count:,} vertices; is it truncated?")
    table = words.values[at:end].reshape(count, width)
    channels = width - 3 - normal - uv
    if not colour and not (channels in (3, 4) and _look_like_colours(table[:, -channels:])):
        channels = 0
    channels = min(channels, 4)
    if width > 3 + normal + channels + uv:
        file.warn(f"its vertices have {width} numbers, more than its header announces; drawn without the last")
    # MeshLab writes the letters as NC, against the description, and the colour before the normal.
    sizes = {"positions": 3, "colours": channels, "normals": normal, "uvs": uv}
    if "NC" not in letters:
        sizes = {"positions": 3, "normals": normal, "colours": channels, "uvs": uv}
    arrays: dict[str, Float64 | None] = {}
    first = 0
    for name, size in sizes.items():
        arrays[name] = table[:, first : first + size] if size else None
        first += size
    colours = arrays["colours"]
    if colours is not None:
        arrays["colours"] = display_colours(np.clip(colours / (255 if (colours > 1).any() else 1), 0, 1))
    return arrays, end


def _look_like_colours(columns: Float64) -> bool:
    """Returns whether numbers that the header does not announce are colours, which many programs write after a plain "OFF"."""
    if not (columns >= 0).all():
        return False
    return bool((columns <= 1).all() or ((columns <= 255) & (columns == np.floor(columns))).all())


def _have_lines(lines: Int64, width: int) -> bool:
    """Returns whether each run of `width` numbers has a line of its own. lines: (N,) the lines of the numbers."""
    table = lines.reshape(-1, width)
    return bool((table[:, 0] == table[:, -1]).all() and (table[1:, 0] > table[:-1, 0]).all())


def _add_faces(file: MeshFile, words: _Words, at: int, count: int, arrays: dict[str, Any]) -> None:
    """Adds the parts of a file: its polygons, the lines and the points among its faces. Errors: AssetError."""
    positions = arrays["positions"]
    given = {key: value for key, value in arrays.items() if key != "positions"}
    if not count:
        file.contents.add(file.path.stem, file.build_points("", positions, **given))
        return
    starts, counts = _faces(file, words, at, count)
    offsets = np.cumsum(counts) - counts
    corners = np.arange(int(counts.sum())) - np.repeat(offsets, counts) + np.repeat(starts + 1, counts)
    raw = words.values[corners]
    wrong = (raw < 0) | (raw >= len(positions)) | (raw != np.floor(raw))
    if wrong.any():
        first = int(wrong.argmax())
        face = int(np.searchsorted(np.cumsum(counts), first, side="right"))
        raise file.fail(f"face {face:,}: vertex index {raw[first]:g} is out of range: the file has {len(positions):,}")
    indices = raw.astype(np.int64)
    try:
        triangles, owners = cut(indices, counts, positions)
    except ValueError as error:
        raise file.fail(str(error)) from None
    title = file.path.stem
    if len(triangles):
        colours = _face_colours(file, words, starts, counts)
        triangles = indices[triangles]
        if colours is not None:
            corner = triangles.reshape(-1)
            arrays = {key: None if value is None else value[corner] for key, value in arrays.items()}
            arrays["colours"] = np.repeat(colours[owners], 3, axis=0)
            triangles = np.arange(len(corner)).reshape(-1, 3)
        file.contents.add(title, file.build("", triangles=triangles, **arrays))
    pairs = indices[offsets[counts == 2][:, None] + np.arange(2)]
    if len(pairs):
        file.contents.add(f"{title}.lines" if len(triangles) else title, file.build_lines("", positions, pairs, **given))
    singles = indices[offsets[counts == 1]]
    if len(singles):
        several = len(triangles) or len(pairs)
        file.contents.add(f"{title}.points" if several else title, file.build_points("", positions, singles, **given))


def _faces(file: MeshFile, words: _Words, at: int, count: int) -> tuple[Int64, Int64]:
    """Returns the index (F,) of the first number of each face, its number of corners, and these numbers (F,).

    Errors: AssetError, with the face.
    """
    values, lines = words.values, words.lines
    begins = at + np.flatnonzero(np.append(True, np.diff(lines[at:]) > 0))[: count + 1]
    if len(begins) >= count and at < len(values):
        starts = begins[:count]
        sizes = np.diff(np.append(begins, len(values)))[:count]
        lengths = values[starts]
        if ((lengths >= 0) & (lengths == np.floor(lengths)) & (lengths < sizes)).all():
            return starts, lengths.astype(np.int64)
    # The faces have no lines of their own, so that none has a colour and each begins where the one before ends.
    found = np.empty(count, dtype=np.int64)
    for face in range(count):
        found[face] = at
        length = values[at] if at < len(values) else np.inf
        if not (0 <= length < len(values) - at and length == int(length)):
            problem = words.problem or (
                f"face {face:,} cannot have {length:g} corners" if at < len(values) else f"ends before face {face:,}"
            )
            raise file.fail(f"{problem}; is it truncated?")
        at += 1 + int(length)
    return found, values[found].astype(np.int64)


def _face_colours(file: MeshFile, words: _Words, starts: Int64, counts: Int64) -> Float64 | None:
    """Returns the colours of the faces (F, 4), white where a face has none; None where no face has one.

    A face's line ends with nothing, with the index of a colour in a table that only Geomview has, or with a colour.
    """
    values, lines = words.values, words.lines
    begins = starts + 1 + counts
    ends = np.searchsorted(lines, lines[starts], side="right")
    if len(starts) > 1 and (lines[starts[1:]] == lines[starts[:-1]]).any():
        return None
    extra = np.maximum(ends - begins, 0)
    if (extra == 1).any():
        file.warn("its faces name colours of a table that the file does not hold; drawn without them")
    coloured = np.flatnonzero((extra >= 3) & (extra <= 4))
    if ((extra == 2) | (extra > 4)).any():
        file.warn("some faces have 2 or more than 4 numbers after their corners, which are no colour; drawn without them")
    if not len(coloured):
        return None
    colours = np.ones((len(starts), 4))
    for channels in (3, 4):
        rows = coloured[extra[coloured] == channels]
        colours[rows, :channels] = values[begins[rows, None] + np.arange(channels)]
    largest = colours[coloured].max(axis=1)
    integers = _are_integers(colours[coloured])
    # A program that writes floats without needless digits writes 1 and 0 for them, so that only a larger number shows bytes.
    in_bytes = (largest > 1) | (integers & (largest[integers].max(initial=0) > 1))
    scaled = coloured[in_bytes]
    opaque = extra[scaled] == 3
    colours[scaled] /= 255
    colours[scaled[opaque], 3] = 1
    return display_colours(np.clip(colours, 0, 1))


def _are_integers(colours: Float64) -> Array:
    """Returns which colours (N, 4) consist of integers."""
    result: Array = (colours == np.floor(colours)).all(axis=1)
    return result
