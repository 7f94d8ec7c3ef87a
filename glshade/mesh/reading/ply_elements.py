"""PLY elements: the header of a PLY file and the tables that it describes, in all three forms of the format (Turk 1994).

The text form is read as if it were a binary file in which every number, also the length of a list, is a float64.
"""

from __future__ import annotations

import re
import struct
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from glshade.arrays import Array, Int64
from glshade.errors import AssetError
from glshade.mesh.reading.file import MeshFile, short
from glshade.mesh.reading.number_text import numbers

# The names of types in headers -> NumPy's names. Turk's description has the first eight; the others are what programs write.
_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4", "double": "f8",
    "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4", "int64": "i8", "uint64": "u8",
    "float16": "f2", "float32": "f4", "float64": "f8", "half": "f2", "longlong": "i8", "ulonglong": "u8",
}  # fmt: skip
# NumPy's names of types -> the letters of the module struct, which stand for the same sizes on every machine.
_LETTERS = dict(zip(("i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f2", "f4", "f8"), "bBhHiIqQefd", strict=True))
_FORMATS = {"ascii": "<", "binary_little_endian": "<", "binary_big_endian": ">"}
# The longest header [bytes]. Headers have a few hundred bytes; those of programs that write their settings into it, thousands.
_LONGEST_HEADER = 1 << 20
# The properties of a file. Meshes have about 10, clouds of Gaussian splats 62.
_MOST_PROPERTIES = 10_000


@dataclass(frozen=True)
class Property:
    """One property of an element.

    name: the name in the header.
    kind: NumPy's name of its type, such as "f4".
    length: NumPy's name of the type of a list's length; None where the property is one number.
    """

    name: str
    kind: str
    length: str | None = None


@dataclass
class Element:
    """One element of the header: a table with `count` rows."""

    name: str
    count: int
    properties: list[Property] = field(default_factory=list)


@dataclass(frozen=True)
class Table:
    """The rows of an element.

    count: the number of rows N.
    columns: property -> its numbers (N,).
    lists: property -> the lengths of its lists (N,), and the numbers of all lists, one list after another.
    kinds: property -> NumPy's name of the type that the header declares, which the text form does not have in `columns`.
    """

    count: int
    columns: dict[str, Array]
    lists: dict[str, tuple[Int64, Array]]
    kinds: dict[str, str]


@dataclass(frozen=True)
class Header:
    """The header of a PLY file.

    form: "ascii", "binary_little_endian" or "binary_big_endian".
    elements: the elements in their order.
    comments: the text of each line "comment" or "obj_info".
    size: the number of bytes up to the first byte of the data.
    lines: the number of lines of the header.
    """

    form: str
    elements: list[Element]
    comments: list[str]
    size: int
    lines: int


def header(file: MeshFile) -> Header:
    """Returns the header of a PLY file. Errors: AssetError, with the line."""
    head = file.data[:_LONGEST_HEADER]
    if not re.match(rb"ply[ \t]*[\r\n]", head, re.IGNORECASE):
        raise file.fail("is not a readable PLY file: it does not begin with the line 'ply'")
    # Where lines end with "\r" alone, a "\n" after the last of them is the first byte of the data.
    line_end = rb"\r" if re.match(rb"[^\r\n]*\r[^\n]", head) else rb"\r?\n"
    end = re.search(rb"[\r\n]end_header[ \t]*(?:" + line_end + rb"|\Z)", head, re.IGNORECASE)
    if end is None:
        raise file.fail("is not a readable PLY file: its header has no line 'end_header'; is the file truncated?")
    lines = re.split(line_end, head[: end.start()])
    form, elements, comments = "", list[Element](), list[str]()
    properties = 0
    for number, raw in enumerate(lines[1:], 2):
        line = _decoded(raw)
        word, *rest = line.split(maxsplit=1) or [""]
        words = line.split()
        keyword = word.lower()
        if keyword in ("comment", "obj_info"):
            comments.append(rest[0].strip() if rest else "")
        elif keyword == "format":
            form = words[1].lower() if len(words) > 1 else ""
            if form not in _FORMATS:
                known = ", ".join(_FORMATS)
                raise file.fail(f"line {number}: the format '{_quoted(form)}' is unknown; PLY has {known}")
        elif keyword == "element":
            if len(words) != 3 or not words[2].isdecimal():
                raise file.fail(f"line {number}: '{_quoted(line)}' is not an element with its name and its count")
            elements.append(Element(words[1], int(words[2])))
        elif keyword == "property":
            properties += 1
            if not elements or properties > _MOST_PROPERTIES:
                wrong = "belongs to no element" if not elements else f"comes after {_MOST_PROPERTIES:,} others"
                raise file.fail(f"line {number}: the property '{_quoted(line)}' {wrong}")
            elements[-1].properties.append(_property(file, number, words))
        elif keyword and not elements:
            # Some programs break a comment into two lines.
            file.warn(f"line {number}: '{_quoted(line)}' is no line of a PLY header; left out")
        elif keyword:
            raise file.fail(f"line {number}: '{_quoted(line)}' is no line of a PLY header")
    if not form:
        raise file.fail("is not a readable PLY file: its header has no line 'format'")
    return Header(form, elements, comments, end.end(), len(lines) + 1)


def _property(file: MeshFile, number: int, words: list[str]) -> Property:
    """Returns the property that a line of the header declares. Errors: AssetError."""
    is_list = len(words) == 5 and words[1].lower() == "list"
    if not is_list and len(words) != 3:
        raise file.fail(f"line {number}: '{_quoted(' '.join(words))}' is not a property with its type and its name")
    kinds = []
    for word in words[2:4] if is_list else words[1:2]:
        kind = _TYPES.get(word.lower().removesuffix("_t"))
        if kind is None:
            raise file.fail(f"line {number}: the type '{_quoted(word)}' is unknown; PLY has {', '.join(list(_TYPES)[:8])}")
        kinds.append(kind)
    return Property(words[-1], kinds[-1], kinds[0] if is_list else None)


def tables(file: MeshFile, head: Header) -> dict[str, Table]:
    """Returns the tables of a PLY file by the names of their elements. Errors: AssetError, with element and row."""
    if head.form != "ascii":
        return _tables(file, head, file.data, head.size)[0]
    text = file.data[head.size :]
    result, left, error = None, 0, None
    try:
        result, left = _text_tables(file, head, text)
    except AssetError as fault:
        error = fault
    if error is not None or left:
        # A row is a line. What follows on its line after the numbers that the header declares is left out.
        trimmed = _without_tails(text, head.elements)
        if trimmed is not None:
            file.warn("its lines have more numbers than the header declares; drawn without them")
            return _text_tables(file, head, trimmed)[0]
    if result is None:
        assert error is not None
        raise error
    if left:
        file.warn(f"{left:,} numbers after its last element are not read")
    return result


def _text_tables(file: MeshFile, head: Header, text: bytes) -> tuple[dict[str, Table], int]:
    """Returns the tables of a file in text form, and the number of numbers that follow them. Errors: AssetError."""
    values, problem = numbers(text, head.lines + 1)
    data = values.astype("<f8", copy=False).view(np.uint8).data
    tables, position = _tables(file, head, data, 0, problem)
    return tables, len(values) - position // 8


def _without_tails(text: bytes, elements: list[Element]) -> bytes | None:
    """Returns the rows of a text, each without the numbers that no property declares.

    The result is None where rows are no lines, or where they have no such numbers.
    """
    lines = iter([line for line in re.split(rb"[\r\n]", text) if line.strip()])
    rows, tails = [], False
    try:
        for element in elements:
            for _ in range(element.count if element.properties else 0):
                words, size = next(lines).split(), 0
                for p in element.properties:
                    size += 1 if p.length is None else 1 + int(words[size])
                if not 0 <= size <= len(words):
                    return None
                rows.append(b" ".join(words[:size]))
                tails |= size < len(words)
    except (StopIteration, ValueError, IndexError):
        return None
    return b"\n".join(rows) if tails else None


def _tables(
    file: MeshFile, head: Header, data: bytes | memoryview, position: int, problem: str = ""
) -> tuple[dict[str, Table], int]:
    """Returns the tables in `data` from a position on, and the position after them. Errors: AssetError.

    problem: a message about what ended the numbers of the text form; empty where nothing did.
    """
    elements, unit, scale = head.elements, "bytes", 1
    if head.form == "ascii":
        elements, unit, scale = [_as_float64(element) for element in elements], "numbers", 8
    result: dict[str, Table] = {}
    for element, declared in zip(elements, head.elements, strict=True):
        try:
            table, position = _Rows(data, position, len(data), _FORMATS[head.form], element).read()
        except _Wrong as wrong:
            missing, there = f"{-(-wrong.needed // scale):,}", f"{wrong.there // scale:,}"
            message = wrong.message.format(unit=unit, missing=missing, there=there)
            raise file.fail(f"element {_quoted(element.name)}: {problem or message}") from None
        kinds = {p.name: p.kind for p in declared.properties}
        result.setdefault(element.name, Table(table.count, table.columns, table.lists, kinds))
    return result, position


def _as_float64(element: Element) -> Element:
    """Returns an element of the text form as one whose numbers are all float64."""
    properties = [Property(p.name, "f8", p.length and "f8") for p in element.properties]
    return Element(element.name, element.count, properties)


@dataclass
class _Wrong(Exception):
    """Rows that cannot be read.

    message: what is wrong, in which {missing}, {there} and {unit} stand for the two numbers below.
    needed: the bytes that the rows need.
    there: the bytes that the file has for them.
    """

    message: str
    needed: int = 0
    there: int = 0


class _Rows:
    """Reads the rows of one element."""

    def __init__(self, data: bytes | memoryview, position: int, end: int, order: str, element: Element) -> None:
        """position: the first byte of the rows. end: the number of bytes of `data`. order: "<" or ">", the order of bytes."""
        self._data, self._position, self._end, self._order, self._element = data, position, end, order, element
        self._lists = [p for p in element.properties if p.length is not None]

    def read(self) -> tuple[Table, int]:
        """Returns the rows, and the position of the first byte after them. Errors: _Wrong."""
        count, properties = self._element.count, self._element.properties
        least = self._dtype([0] * len(self._lists)).itemsize
        there = self._end - self._position
        if count * least > there:
            raise _Wrong(
                f"its {count:,} rows need {{missing}} {{unit}} or more, but the file has {{there}}; is it truncated?",
                count * least,
                there,
            )
        columns: dict[str, Array] = {}
        lists: dict[str, tuple[Int64, Array]] = {}
        if not count or not properties:
            empty = np.zeros(0)
            if not count:
                columns = {p.name: empty for p in properties if p.length is None}
                lists = {p.name: (np.zeros(0, dtype=np.int64), empty) for p in self._lists}
            return Table(count, columns, lists, {}), self._position
        blocks, position = self._blocks()
        whole = len(blocks) == 1
        for index, p in enumerate(properties):
            # Where a header names a property twice, the first is read.
            if p.name in columns or p.name in lists:
                continue
            if p.length is None:
                columns[p.name] = blocks[0][1][f"p{index}"] if whole else np.empty(count, dtype=self._order + p.kind)
                for rows, block in () if whole else blocks:
                    columns[p.name][rows] = block[f"p{index}"]
                continue
            lengths = np.empty(count, dtype=np.int64)
            for rows, block in blocks:
                lengths[rows] = block.dtype[f"p{index}"].shape[0]
            starts = np.cumsum(lengths) - lengths
            values = np.empty(int(lengths.sum()), dtype=self._order + p.kind)
            for rows, block in blocks:
                part = block[f"p{index}"]
                if whole:
                    values = part.reshape(-1)
                else:
                    values[starts[rows, None] + np.arange(part.shape[1])] = part
            lists[p.name] = lengths, values
        return Table(count, columns, lists, {}), position

    def _dtype(self, lengths: list[int]) -> np.dtype[np.void]:
        """Returns the type of a row whose lists have these lengths. Its fields are p0, p1 ..., and n0, n1 ... for lengths."""
        remaining = iter(lengths)
        fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
        for index, p in enumerate(self._element.properties):
            if p.length is None:
                fields.append((f"p{index}", self._order + p.kind))
            else:
                fields.append((f"n{index}", self._order + p.length))
                fields.append((f"p{index}", self._order + p.kind, (next(remaining),)))
        return np.dtype(fields)

    def _blocks(self) -> tuple[list[tuple[Int64 | slice, Array]], int]:
        """Returns blocks of rows whose lists have the same lengths, each with its rows' numbers, and the position after all.

        Errors: _Wrong.
        """
        count = self._element.count
        if not self._lists:
            dtype = self._dtype([])
            rows = np.frombuffer(self._data, dtype, count, self._position)
            return [(slice(None), rows)], self._position + rows.nbytes
        # Most files have triangles alone, or quads alone.
        _, first = self._walk(1)
        dtype = self._dtype(first[0].tolist())
        if count * dtype.itemsize <= self._end - self._position:
            rows = np.frombuffer(self._data, dtype, count, self._position)
            names = [name for name in dtype.names or () if name.startswith("n")]
            if all((rows[name] == length).all() for name, length in zip(names, first[0].tolist(), strict=True)):
                return [(slice(None), rows)], self._position + rows.nbytes
        starts, lengths = self._walk(count)
        return [*self._grouped(starts[:-1], lengths)], int(starts[-1])

    def _grouped(self, starts: Int64, lengths: Int64) -> Iterator[tuple[Int64, Array]]:
        """Yields the blocks of rows. starts: (N,) their first bytes. lengths: (N, L) the lengths of their L lists."""
        key = np.zeros(len(starts), dtype=np.int64)
        for column in lengths.T:
            _, inverse = np.unique(column, return_inverse=True)
            _, key = np.unique(key * (int(inverse.max()) + 1) + inverse, return_inverse=True)
        order = np.argsort(key, kind="stable")
        data = np.frombuffer(self._data, np.uint8)
        for rows in np.split(order, np.flatnonzero(np.diff(key[order])) + 1):
            dtype = self._dtype(lengths[rows[0]].tolist())
            windows = np.lib.stride_tricks.sliding_window_view(data, dtype.itemsize)
            yield rows, np.ascontiguousarray(windows[starts[rows]]).view(dtype)[:, 0]

    def _walk(self, count: int) -> tuple[Int64, Int64]:
        """Returns the first byte of each of the first rows and of the row after them (count + 1,), and the lengths of their
        lists (count, L). Errors: _Wrong.
        """
        steps, skip = [], 0
        for p in self._element.properties:
            size = np.dtype(p.kind).itemsize
            if p.length is None:
                skip += size
            else:
                form = struct.Struct(self._order + _LETTERS[p.length])
                steps.append((skip, form.unpack_from, form.size, size))
                skip = 0
        data, position, end = self._data, self._position, self._end
        starts, lengths = array("q"), array("q")
        for row in range(count):
            starts.append(position)
            for before, unpack, own, size in steps:
                position += before
                if position + own > end:
                    raise _Wrong(f"the file ends in row {row:,} of {self._element.count:,}; is it truncated?")
                (length,) = unpack(data, position)
                if not 0 <= length <= end or length != int(length):
                    raise _Wrong(f"row {row:,}: a list cannot have {length:g} numbers")
                lengths.append(int(length))
                position += own + int(length) * size
            position += skip
            if position > end:
                raise _Wrong(f"the file ends in row {row:,} of {self._element.count:,}; is it truncated?")
        starts.append(position)
        return np.frombuffer(starts, np.int64), np.frombuffer(lengths, np.int64).reshape(count, len(steps))


def _decoded(line: bytes) -> str:
    """Returns a line of the header as text. Headers are ASCII; names and comments in them may be UTF-8 or Latin-1."""
    try:
        return line.decode()
    except UnicodeDecodeError:
        return line.decode("latin-1")


def _quoted(text: str) -> str:
    """Returns a text for a message, in which a number stands for a letter that cannot be seen, such as a soft hyphen."""
    return "".join(letter if letter.isprintable() else f"\\u{ord(letter):04x}" for letter in short(text))
