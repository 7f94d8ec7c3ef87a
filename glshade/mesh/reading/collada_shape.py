"""COLLADA shapes: the vertices and the primitives of an element <geometry> as arrays (COLLADA 1.4.1 and 1.5)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from xml.etree.ElementTree import Element

import numpy as np

from glshade.arrays import Float64, Int64
from glshade.errors import printable
from glshade.mesh.reading.faces import cut, strips
from glshade.mesh.reading.file import MeshFile, short
from glshade.mesh.reading.number_text import numbers

_POLYGONS = ("triangles", "polylist", "polygons")
_LINES = ("lines", "linestrips")
KINDS = (*_POLYGONS, "tristrips", "trifans", *_LINES)


@dataclass(frozen=True)
class _Input:
    """An input of a primitive: which source a column of its indices refers to."""

    semantic: str
    source: str
    offset: int
    set: int


@dataclass(frozen=True)
class Primitive:
    """Triangles or lines with one material.

    material: the symbol of the material; None for none.
    size: 3 for triangles, 2 for lines.
    corners: (C, columns) the indices of all corners.
    simplices: (T, size) the triangles or lines, as indices into `corners`.
    inputs: the inputs of the columns.
    """

    material: str | None
    size: int
    corners: Int64
    simplices: Int64
    inputs: tuple[_Input, ...]

    def sets(self) -> list[int]:
        """Returns the numbers of the sets of texture coordinates, in the order of the file."""
        return [given.set for given in self.inputs if given.semantic == "TEXCOORD"]


class Shape:
    """The sources and the primitives of a geometry."""

    def __init__(self, file: MeshFile, geometry: Element) -> None:
        """Errors: AssetError."""
        self._file = file
        self._name = printable(short(geometry.get("name") or geometry.get("id") or "a geometry"))
        mesh = geometry.find("mesh")
        self._sources = {f"#{e.get('id')}": e for e in (() if mesh is None else mesh.findall("source"))}
        self._vertices = {f"#{e.get('id')}": e for e in (() if mesh is None else mesh.findall("vertices"))}
        self._arrays: dict[str, Float64] = {}
        self.primitives = [] if mesh is None else [p for e in mesh if e.tag in KINDS for p in self._primitive(e)]

    def fail(self, message: str) -> Exception:
        """Returns an error to raise, which names the geometry."""
        return self._file.fail(f"geometry '{self._name}': {message}")

    def arrays(self, primitive: Primitive, uv_set: int | None) -> dict[str, Float64 | Int64 | None]:
        """Returns positions, normals, uvs and colours of a primitive's vertices, and its simplices by their names in `build`.

        uv_set: the set of texture coordinates to take; the first one where there is no such set.
        Errors: AssetError for an index out of range.
        """
        chosen = {"positions": self._find(primitive, "POSITION"), "normals": self._find(primitive, "NORMAL")}
        uvs = [given for given in primitive.inputs if given.semantic == "TEXCOORD"]
        chosen["uvs"] = next((given for given in uvs if given.set == uv_set), uvs[0] if uvs else None)
        chosen["colours"] = self._find(primitive, "COLOR")
        used = {name: given for name, given in chosen.items() if given is not None}
        if "positions" not in used:
            raise self.fail("a primitive has no positions")
        columns = sorted({given.offset for given in used.values()})
        flat = primitive.corners[primitive.simplices.reshape(-1)]
        if len(columns) == 1:
            one, local = np.unique(flat[:, columns[0]], return_inverse=True)
            indices = {columns[0]: one}
        else:
            indices, local = {column: flat[:, column] for column in columns}, np.arange(len(flat))
        arrays: dict[str, Float64 | Int64 | None] = dict.fromkeys(chosen)
        for name, given in used.items():
            values, at = self._source(given.source), indices[given.offset]
            if len(at) and (at.min() < 0 or at.max() >= len(values)):
                bad = at.min() if at.min() < 0 else at.max()
                raise self.fail(
                    f"index {bad} is out of range: source '{printable(short(given.source))}' has {len(values):,} entries"
                )
            wanted = 2 if name == "uvs" else 3
            if values.shape[1] < wanted:
                raise self.fail(f"the {name} have {values.shape[1]} numbers each, not {wanted}")
            arrays[name] = values[at] if name == "colours" else values[at, :wanted]
        arrays["simplices"] = local.reshape(-1, primitive.size)
        return arrays

    @staticmethod
    def _find(primitive: Primitive, semantic: str) -> _Input | None:
        return next((given for given in primitive.inputs if given.semantic == semantic), None)

    def _source(self, reference: str) -> Float64:
        """Returns the entries (N, columns) of a source. Errors: AssetError."""
        if reference not in self._arrays:
            element = self._sources.get(reference)
            array = None if element is None else next((e for e in element if e.tag in ("float_array", "int_array")), None)
            if element is None or array is None:
                raise self.fail(f"has no source '{printable(short(reference))}' of numbers")
            self._arrays[reference] = self._entries(reference, self._numbers(array), element.find("technique_common/accessor"))
        return self._arrays[reference]

    def _entries(self, reference: str, values: Float64, accessor: Element | None) -> Float64:
        """Returns the entries that an accessor takes from the numbers of a source. Errors: AssetError."""
        if accessor is None:
            return values[: len(values) // 3 * 3].reshape(-1, 3)
        # Parameters without a name are skipped.
        params = accessor.findall("param")
        stride, offset = self._integer(accessor, "stride", max(len(params), 1)), self._integer(accessor, "offset", 0)
        count = self._integer(accessor, "count", (len(values) - offset) // max(stride, 1))
        needed = offset + count * stride
        if stride < 1 or stride < len(params) or needed > len(values):
            raise self.fail(
                f"source '{printable(short(reference))}' has {len(values):,} numbers, and its accessor needs {needed:,}"
            )
        table = values[offset:needed].reshape(count, stride)
        named = [column for column, param in enumerate(params) if param.get("name")]
        return table[:, named] if named else table[:, : len(params) or stride]

    def _integer(self, element: Element, key: str, default: int) -> int:
        """Returns an attribute that is an integer of 0 or more. Errors: AssetError."""
        text = element.get(key)
        if text is None:
            return default
        if not text.strip().isdecimal():
            raise self.fail(f"<{element.tag}>: {key}='{printable(short(text))}' is not a number")
        return int(text)

    def _numbers(self, element: Element | None) -> Float64:
        """Returns the numbers in the text of an element. Errors: AssetError."""
        text = "" if element is None else (element.text or "").replace(",", ".")
        values, problem = numbers(text.encode("ascii", "replace"))
        if problem and element is not None:
            raise self.fail(f"<{element.tag}>, {problem}")
        return values

    def _integers(self, element: Element | None) -> Int64:
        """Returns the indices in the text of an element. Errors: AssetError."""
        values = self._numbers(element)
        if not (np.abs(values) < 2.0**62).all():  # also where one is no number
            raise self.fail("an index is out of range")
        return values.astype(np.int64)

    def _inputs(self, element: Element) -> Iterator[_Input]:
        """Yields the inputs of a primitive. An input VERTEX stands for those of the element <vertices>. Errors: AssetError."""
        for given in element.findall("input"):
            semantic, source = given.get("semantic", ""), given.get("source", "")
            offset, number = self._integer(given, "offset", 0), self._integer(given, "set", 0)
            if semantic != "VERTEX":
                yield _Input(semantic, source, offset, number)
                continue
            vertices = self._vertices.get(source)
            if vertices is None:
                raise self.fail(f"has no vertices '{printable(short(source))}'")
            for inner in vertices.findall("input"):
                yield _Input(inner.get("semantic", ""), inner.get("source", ""), offset, number)

    def _primitive(self, element: Element) -> Iterator[Primitive]:
        """Yields the primitive of an element, unless it is empty. Errors: AssetError."""
        inputs = tuple(self._inputs(element))
        # All inputs have columns, also those with a semantic that is not read.
        columns = 1 + max((self._integer(given, "offset", 0) for given in element.findall("input")), default=-1)
        if not inputs:
            if element.find("p") is not None:
                raise self.fail(f"<{element.tag}> has no inputs")
            return
        lists = [self._integers(p) for p in element.findall("p")]
        if holes := element.findall("ph"):
            self._file.warn(f"geometry '{self._name}': holes of polygons are not read; drawn without them")
            lists += [self._integers(hole.find("p")) for hole in holes]
        if any(len(one) % columns for one in lists):
            raise self.fail(f"<{element.tag}> does not have {columns} indices for each corner")
        corners = np.concatenate([np.empty((0, columns), dtype=np.int64), *(one.reshape(-1, columns) for one in lists)])
        lengths = np.array([len(one) // columns for one in lists], dtype=np.int64)
        simplices = self._simplices(element, inputs, corners, lengths)
        if len(simplices):
            yield Primitive(element.get("material"), simplices.shape[1], corners, simplices, inputs)

    def _simplices(self, element: Element, inputs: tuple[_Input, ...], corners: Int64, lengths: Int64) -> Int64:
        """Returns the triangles (T, 3) or lines (S, 2), as indices into `corners`. Errors: AssetError.

        lengths: the number of corners of each list <p>.
        """
        kind, count = element.tag, len(corners)
        ends = np.cumsum(lengths)
        if kind == "lines":
            return np.arange(count // 2 * 2).reshape(-1, 2)
        if kind == "linestrips":
            starts = np.delete(np.arange(count), ends - 1) if count else np.empty(0, dtype=np.int64)
            return np.column_stack([starts, starts + 1])
        if kind == "tristrips":
            places = np.insert(np.arange(count), ends, -1)
            return places[strips(places)]
        if kind == "trifans":
            fans = [
                np.column_stack([np.full(n - 2, end - n), np.arange(end - n + 1, end - 1), np.arange(end - n + 2, end)])
                for n, end in zip(lengths.tolist(), ends.tolist(), strict=True)
                if n > 2
            ]
            return np.concatenate([np.empty((0, 3), dtype=np.int64), *fans])
        counts = lengths
        if kind == "triangles":
            counts = np.full(count // 3, 3)
        elif kind == "polylist":
            counts = self._integers(element.find("vcount"))
            if (counts < 0).any() or counts.sum() > count:
                raise self.fail(f"<polylist> has {count:,} corners, and its <vcount> needs {counts.sum():,}")
        position = next((given for given in inputs if given.semantic == "POSITION"), None)
        if position is None:
            raise self.fail(f"<{kind}> has no positions")
        values = self._source(position.source)
        at = corners[:, position.offset]
        if len(at) and (at.min() < 0 or at.max() >= len(values) or values.shape[1] < 3):
            raise self.fail(
                f"index {at.max() if at.min() >= 0 else at.min()} is out of range: it has {len(values):,} positions"
            )
        try:
            return cut(at, counts, values[:, :3])[0]
        except ValueError as error:
            raise self.fail(str(error)) from None
