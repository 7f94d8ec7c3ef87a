"""glTF accessors: the arrays of numbers of a glTF file (glTF 2.0, 3.6), checked against its bytes before they are read."""

from __future__ import annotations

from typing import Any

import numpy as np

from glshade.arrays import Array, Float64, Int64
from glshade.mesh.reading.file import MeshFile, short
from glshade.mesh.reading.gltf_compressed import meshopt_view
from glshade.mesh.reading.gltf_container import MESHOPT

# The number of a component's type -> its type (glTF 2.0, 3.6.2.2).
TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
# The name of an element's type -> the number of its components. Matrices of 2 and 3 columns have padding, and no attribute that
# is read here consists of them.
COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class Accessors:
    """The accessors of a file.

    Corners and values are counted before they are read, because accessors may share bytes or need none. A small file may then
    ask for more than fits into memory.
    """

    def __init__(self, file: MeshFile, header: dict[str, Any], buffers: list[bytes]) -> None:
        """header: the JSON of the file, whose shape is checked. buffers: the bytes of its buffers."""
        self.file, self.header, self.buffers = file, header, buffers
        self.tables: list[dict[str, Any]] = header.get("accessors", [])
        self.views: list[dict[str, Any]] = header.get("bufferViews", [])
        self.stored = len(file.data) + sum(map(len, buffers))
        # The number of corners of triangles, or of half as many values of vertices, that may still be read.
        self.left = max(3 * file.limits.max_triangles, self.stored)
        # Number of a view -> its bytes, of the views that are stored compressed.
        self._unpacked: dict[int, bytes] = {}

    def spend(self, corners: int, values: int) -> None:
        """Counts what is about to be read or made.

        corners: the number of corners of triangles.
        values: the number of values of vertices. A vertex may be shared by six triangles.

        Errors: AssetError where the file stores less than that, and the limits do not allow it.
        """
        self.left -= max(corners, values // 2)
        if self.left < 0:
            most = self.file.limits.max_triangles
            wanted = (max(3 * most, self.stored) - self.left) // 3
            raise self.file.fail(
                f"its meshes have {wanted:,} triangles, more than it stores; {most:,} are allowed: see --max-triangles"
            )

    def count(self, index: int) -> int:
        """Returns the number of elements of an accessor."""
        return int(self.tables[index]["count"])

    def has_data(self, index: int) -> bool:
        """Returns whether an accessor has bytes of its own in the file. Without any, its values are 0, or stored compressed."""
        return "bufferView" in self.tables[index] or "sparse" in self.tables[index]

    def floats(self, index: int, columns: tuple[int, ...], fractions: bool = False) -> Float64:
        """Returns the elements (N, C) of an accessor. Integers that are marked as normalized are fractions (glTF 2.0, 3.6.2.2).

        columns: the numbers of components C that are allowed.
        fractions: whether integers are fractions in any case, as those of colours and weights.

        Errors: AssetError.
        """
        return self.scaled(index, self.elements(index, columns), fractions)

    def scaled(self, index: int, values: Array, fractions: bool = False) -> Float64:
        """Returns values that an accessor describes as float64. fractions: as in `floats`."""
        if values.dtype.kind == "f" or not (fractions or self.tables[index].get("normalized", False)):
            return values.astype(np.float64)
        result: Float64 = np.maximum(values / np.iinfo(values.dtype).max, -1.0)
        return result

    def integers(self, index: int, columns: int = 1) -> Int64:
        """Returns the elements (N, columns) of an accessor of integers. Errors: AssetError."""
        values = self.elements(index, (columns,))
        if values.dtype.kind not in "iu":
            raise self.file.fail(f"accessors[{index}] holds numbers with fractions, where whole numbers are needed")
        return values.astype(np.int64)

    def elements(self, index: int, columns: tuple[int, ...]) -> Array:
        """Returns the elements (N, C) of an accessor, in the type in which the file stores them. columns: as in `floats`.

        Errors: AssetError.
        """
        table, where = self.tables[index], f"accessors[{index}]"
        width = COMPONENTS.get(table["type"], 0)
        if width not in columns:
            known = " or ".join(name for name, number in COMPONENTS.items() if number in columns)
            raise self.file.fail(f"{where} is of type {short(table['type'])}, where {known} is needed")
        kind = self._kind(table["componentType"], where)
        count = int(table["count"])
        if "bufferView" in table:
            values = self._values(table["bufferView"], table.get("byteOffset", 0), kind, count, width, where)
        else:
            if count > self.left:
                self.spend(count, 0)
            values = np.zeros((count, width), dtype=kind)
        if "sparse" in table:
            values = self._replaced(values, table["sparse"], f"{where}.sparse")
        return values

    def _kind(self, number: int, where: str) -> str:
        """Returns NumPy's name of a component's type. Errors: AssetError."""
        if number not in TYPES:
            raise self.file.fail(f"{where}.componentType is {number}, which glTF does not have")
        return TYPES[number]

    def _replaced(self, values: Array, table: dict[str, Any], where: str) -> Array:
        """Returns values (N, C) of which those are replaced that a table `sparse` lists. Errors: AssetError."""
        count, indices = table["count"], table["indices"]
        if count > len(values):
            raise self.file.fail(f"{where} replaces {count} of {len(values)} elements")
        kind = self._kind(indices["componentType"], where)
        places = self._values(indices["bufferView"], indices.get("byteOffset", 0), kind, count, 1, f"{where}.indices")
        places = places.reshape(-1).astype(np.int64)
        if count and not 0 <= places.min() <= places.max() < len(values):
            raise self.file.fail(f"{where}.indices: {places.max()} is out of range: {len(values)} elements")
        news, width = table["values"], values.shape[1]
        result = values.copy()
        result[places] = self._values(
            news["bufferView"], news.get("byteOffset", 0), values.dtype.str, count, width, f"{where}.values"
        )
        return result

    def _values(self, view: int, offset: int, kind: str, count: int, width: int, where: str) -> Array:
        """Returns elements (count, width) of a type, from a byte of a view on. Errors: AssetError."""
        data = self.view(view)
        size = np.dtype(kind).itemsize
        step = self.views[view].get("byteStride", 0) or width * size
        needed = offset + (count - 1) * step + width * size
        if count and (step < width * size or needed > len(data)):
            raise self.file.fail(
                f"{where} needs {needed} bytes with {step} bytes an element, but bufferViews[{view}] has {len(data)}"
            )
        if not count:
            return np.zeros((0, width), dtype=kind)
        return np.ndarray((count, width), kind, data, offset, (step, size))

    def view(self, index: int) -> bytes | memoryview:
        """Returns the bytes of a buffer view, decompressed where they are stored compressed only. Errors: AssetError."""
        table, where = self.views[index], f"bufferViews[{index}]"
        data, start = self.buffers[table["buffer"]], table.get("byteOffset", 0)
        name = next((name for name in MESHOPT if name in table.get("extensions", {})), None)
        # A buffer that holds the uncompressed bytes as well is used, since it needs no library.
        if name is not None and not data:
            return self._decompressed(index, table["extensions"][name], where)
        if start + table["byteLength"] > len(data):
            raise self.file.fail(
                f"{where} ends at byte {start + table['byteLength']}, but buffers[{table['buffer']}] has {len(data)}"
            )
        return memoryview(data)[start : start + table["byteLength"]]

    def _decompressed(self, index: int, table: dict[str, Any], where: str) -> bytes:
        """Returns the bytes of a view that is stored compressed. table: the JSON of the extension. Errors: AssetError."""
        if index not in self._unpacked:
            if table["count"] * table["byteStride"] > self.views[index]["byteLength"]:
                raise self.file.fail(f"{where}: its compressed data are longer than the view")
            data, start = self.buffers[table["buffer"]], table.get("byteOffset", 0)
            if start + table["byteLength"] > len(data):
                raise self.file.fail(f"{where}: its compressed data end behind buffers[{table['buffer']}]")
            # A value of a vertex takes up to 16 bytes.
            self.spend(0, table["count"] * max(table["byteStride"], 16) // 16)
            packed = data[start : start + table["byteLength"]]
            self._unpacked[index] = meshopt_view(self.file, where, table, packed)
        return self._unpacked[index]
