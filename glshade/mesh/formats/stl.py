"""STL: triangles, as text with one or more solids, or in binary form, whose triangles may have colours.

Its normals are not read: they belong to faces and follow from the positions. A binary file may have colours in the two spare
bytes of each triangle, with 5 bits for each of red, green and blue. There are two forms, that of VisCAM and SolidView and that
of Materialise Magics, which Wikipedia's article "STL (file format)" describes. The programs show these values unchanged, so
that they are sRGB-encoded.
"""

from __future__ import annotations

import re

import numpy as np

from glshade.arrays import Array, Float64
from glshade.mesh.reading.colours import display_colours
from glshade.mesh.reading.file import MeshFile, short
from glshade.mesh.reading.number_text import numbers

_HEADER = 84
_ROW = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
# Binary files have a zero byte here at the latest: byte 83, the highest of the number of triangles, is 0 below 16.7 million.
_START = 1024
_NOT_X_OR_P = bytes(set(range(256)) - set(b"xp"))
# The text that is read at once [bytes]; larger pieces are not faster and take more memory.
_BLOCK = 1 << 22
_SOLID = re.compile(rb"^[ \t]*+(end)?solid\b([^\n]*)", re.IGNORECASE | re.MULTILINE)
_NORMAL = re.compile(rb"\bfacet\s++normal\s++\S++\s++\S++\s++\S++", re.IGNORECASE)
_WORDS = re.compile(rb"\b(?:(?:end)?(?:facet|loop)|outer|vertex|normal)\b", re.IGNORECASE)
_END_OF_LOOP = re.compile(rb"\bend\s*+loop\b", re.IGNORECASE)


def read(file: MeshFile) -> None:
    """Adds a part for each solid of an STL file. Errors: AssetError."""
    data = file.data
    claimed = int.from_bytes(data[80:_HEADER], "little")
    exact = len(data) >= _HEADER and len(data) == _HEADER + claimed * _ROW.itemsize
    if not exact and b"\0" not in data[:_START]:
        if not re.search(rb"\bfacet\b|\bendsolid\b", data, re.IGNORECASE):
            raise file.fail("is not a readable STL file: neither text with facets nor a binary file")
        _read_text(file)
    elif len(data) < _HEADER:
        raise file.fail(f"is not a readable STL file: a binary file begins with {_HEADER} bytes, and this has {len(data)}")
    else:
        _read_binary(file, claimed)


# --- the binary form -------------------------------------------------------------------------------------------------------


def _read_binary(file: MeshFile, claimed: int) -> None:
    """Adds the triangles of a binary file. claimed: the number of triangles in its header. Errors: AssetError."""
    size = len(file.data) - _HEADER
    there = size // _ROW.itemsize
    count = min(claimed, there)
    if claimed > there:
        file.warn(f"is truncated: it announces {claimed:,} triangles and holds {there:,}; drawn with those")
    elif claimed == 0 and there and size % _ROW.itemsize == 0:
        # Programs that write a file in one pass do not know the number when they write the header.
        count = there
        file.warn(f"announces no triangles and holds {there:,}; drawn with those")
    elif rest := size - count * _ROW.itemsize:
        file.warn(f"{rest:,} bytes after its {claimed:,} triangles are not read")
    if not count:
        raise file.fail("holds no triangles")
    rows = np.frombuffer(file.data, _ROW, count, _HEADER)
    colours = _colours(file.data[:80], rows["attribute"])
    positions = rows["corners"].reshape(-1, 3)
    mesh = file.build(
        "",
        positions,
        np.arange(len(positions)).reshape(-1, 3),
        colours=None if colours is None else np.repeat(colours, 3, axis=0),
    )
    file.contents.add(file.path.stem, mesh)


def _colours(header: bytes, attributes: Array) -> Float64 | None:
    """Returns the colours of the triangles (T, 4); None where the file has none. attributes: (T,), the spare bytes."""
    marked = (attributes & 0x8000) != 0
    channels = np.column_stack([attributes >> shift & 31 for shift in (0, 5, 10)]) / 31
    at = header.find(b"COLOR=")
    if 0 <= at <= len(header) - 10:
        # Magics: red has the lowest bits, and a marked triangle has the colour of the object, which the header holds. A file
        # whose attributes are all 0 comes from a program that writes only the object's colour.
        whole = np.frombuffer(header, np.uint8, 3, at + 6) / 255
        own = ~marked if attributes.any() else np.zeros(len(marked), dtype=bool)
        return display_colours(np.where(own[:, None], channels, whole))
    if not marked.any():
        return None
    # VisCAM and SolidView: blue has the lowest bits, and only a marked triangle has a colour. The others keep the material's.
    return display_colours(np.where(marked[:, None], channels[:, ::-1], 1.0))


# --- the text form ---------------------------------------------------------------------------------------------------------


def _read_text(file: MeshFile) -> None:
    """Adds a part for each solid of a text file. Errors: AssetError, with the line."""
    text = file.data.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    marks = list(_SOLID.finditer(text))
    ends = [mark.start() for mark in marks] + [len(text)]
    # What stands before the first line "solid" has no name.
    pieces = [(b"", 0, ends[0])]
    for mark, end in zip(marks, ends[1:], strict=True):
        # A few programs write a solid on one line.
        facet = _NORMAL.search(mark[2])
        start = mark.start(2) + facet.start() if facet else mark.end()
        pieces.append((b"" if mark[1] else text[mark.start(2) : start], start, end))
    line, counted = 1, 0
    for name, start, end in pieces:
        line += text.count(b"\n", counted, start)
        counted = start
        corners = _corners(file, text[start:end], line)
        if len(corners):
            mesh = file.build("", corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
            file.contents.add(_decoded(name) or file.path.stem, mesh)


def _corners(file: MeshFile, body: bytes, line: int) -> Float64:
    """Returns the corners (T, 3, 3) of the triangles in the text of one solid. line: its first line. Errors: AssetError."""
    pieces = [np.empty((0, 3, 3))]
    start = 0
    while start < len(body):
        # A block ends where a loop ends.
        found = _END_OF_LOOP.search(body, min(start + _BLOCK, len(body)))
        block = body[start : found.end() if found else len(body)]
        start += len(block)
        ends = [end.end() for end in _END_OF_LOOP.finditer(block)]
        last = ends[-1] if ends else 0
        if re.search(rb"\bvertex\b", block[last:], re.IGNORECASE):
            file.warn("ends within a triangle; drawn without it")
        pieces.append(_triangles(file, block[:last], line, len(ends)))
        line += block.count(b"\n")
    return np.concatenate(pieces)


def _triangles(file: MeshFile, block: bytes, line: int, count: int) -> Float64:
    """Returns the corners (T, 3, 3) in a block of text with `count` loops. line: its first line. Errors: AssetError."""
    lower = block.lower()
    # The letter x stands in "vertex" alone, and p in "outer loop" and "endloop".
    is_regular = lower.translate(None, _NOT_X_OR_P) == b"pxxxp" * count
    if is_regular:
        # In most files all numbers can be read, three of a normal and nine of corners for each facet, once the words are gone.
        for word in (b"facet", b"normal", b"outer", b"vertex", b"loop", b"end"):
            lower = lower.replace(word, b" ")
        values, problem = numbers(lower)
        if not problem and len(values) == 12 * count:
            return values.reshape(-1, 4, 3)[:, 1:]
    block = _NORMAL.sub(_blank, block)
    values, problem = numbers(_WORDS.sub(b" ", block), line)
    if problem:
        raise file.fail(problem)
    return values.reshape(-1, 3, 3) if is_regular and len(values) == 9 * count else _fans(file, block, line)


def _blank(found: re.Match[bytes]) -> bytes:
    """Returns the line ends of a match, which keep the numbers of lines right."""
    return b" " + b"\n" * found[0].count(b"\n")


def _fans(file: MeshFile, body: bytes, line: int) -> Float64:
    """Returns the triangles (T, 3, 3) of facets of which some have more or fewer than three corners. Errors: AssetError."""
    triangles, few = [], 0
    for loop in _END_OF_LOOP.split(body)[:-1]:
        values, _ = numbers(_WORDS.sub(b" ", loop))
        if len(values) % 3:
            raise file.fail(f"line {line + loop.count(bytes([10]))}: a vertex needs three numbers")
        line += loop.count(b"\n")
        corners = values.reshape(-1, 3)
        few += len(corners) < 3
        triangles += [corners[[0, k, k + 1]] for k in range(1, len(corners) - 1)]
    if few:
        file.warn(f"{few:,} facets have fewer than 3 corners; drawn without them")
    return np.array(triangles).reshape(-1, 3, 3)


def _decoded(name: bytes) -> str:
    """Returns the name of a solid as text, which is UTF-8 or Latin-1."""
    try:
        return short(name.strip().decode())
    except UnicodeDecodeError:
        return short(name.strip().decode("latin-1"))
