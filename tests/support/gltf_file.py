"""glTF file: builds small glTF files for tests, array by array."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

TYPES = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
SHAPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
# A triangle in the plane z = 0 that faces +z.
TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype="<f4")


class GltfFile:
    """A glTF file while it is built.

    header: the JSON.
    blob: the bytes of the first buffer.
    further: the JSON of further buffers.
    """

    def __init__(self, **header: Any) -> None:
        self.header: dict[str, Any] = {"asset": {"version": "2.0"}, "accessors": [], "bufferViews": [], **header}
        self.blob = b""
        self.further: list[dict[str, Any]] = []

    def view(self, data: bytes, **keys: Any) -> int:
        """Adds bytes, and returns the number of their buffer view."""
        self.blob += b"\0" * (-len(self.blob) % 4)
        self.header["bufferViews"].append({"buffer": 0, "byteOffset": len(self.blob), "byteLength": len(data), **keys})
        self.blob += data
        return len(self.header["bufferViews"]) - 1

    def accessor(self, array: Any, **keys: Any) -> int:
        """Adds an array, and returns the number of its accessor."""
        array = np.asarray(array)
        table = {
            "bufferView": self.view(array.tobytes()),
            "componentType": TYPES[array.dtype.str[1:]],
            "count": len(array),
            "type": SHAPES[array.shape[1] if array.ndim > 1 else 1],
        }
        return self.table({**table, **keys})

    def table(self, accessor: dict[str, Any]) -> int:
        """Adds the JSON of an accessor, and returns its number."""
        self.header["accessors"].append(accessor)
        return len(self.header["accessors"]) - 1

    def primitive(self, indices: Any = None, mode: int | None = None, **attributes: Any) -> dict[str, Any]:
        """Returns the JSON of a primitive. An attribute is an array, or the number of an accessor."""
        given = {name: value if isinstance(value, int) else self.accessor(value) for name, value in attributes.items()}
        table: dict[str, Any] = {"attributes": given}
        if indices is not None:
            table["indices"] = indices if isinstance(indices, int) else self.accessor(np.asarray(indices, dtype="<u2"))
        if mode is not None:
            table["mode"] = mode
        return table

    def one(self, primitive: dict[str, Any], **mesh: Any) -> GltfFile:
        """Makes a primitive the only one of the file. Where the file has no nodes yet, it gets one that shows it."""
        self.header["meshes"] = [{"primitives": [primitive], **mesh}]
        self.header.setdefault("nodes", [{"mesh": 0}])
        return self

    def glb(self) -> bytes:
        """Returns the file in its binary form."""
        header = {**self.header, "buffers": [{"byteLength": len(self.blob)}, *self.further]} if self.blob else self.header
        text = json.dumps(header).encode()
        text += b" " * (-len(text) % 4)
        blob = self.blob + b"\0" * (-len(self.blob) % 4)
        body = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(blob), b"BIN\0") + blob
        return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body

    def write(self, path: Path) -> Path:
        """Writes the binary form to a file, and returns its path."""
        path.write_bytes(self.glb())
        return path
