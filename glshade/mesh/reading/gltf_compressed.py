"""glTF compressed: decodes the geometry that KHR_draco_mesh_compression and EXT_meshopt_compression store.

The two decoders are libraries of the extra `compressed`. They are imported when a file needs them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from glshade.arrays import Array, Int64
from glshade.errors import AssetError
from glshade.mesh.reading.file import MeshFile, short

# The largest number of bytes between two elements of a compressed view [bytes] (EXT_meshopt_compression).
WIDEST = 256
# The filters that undo a lossy encoding -> the sizes of an element that they take [bytes].
FILTERS = {"OCTAHEDRAL": (4, 8), "QUATERNION": (8,), "EXPONENTIAL": tuple(range(4, WIDEST + 1, 4))}


def meshopt_view(file: MeshFile, where: str, table: dict[str, Any], data: bytes) -> bytes:
    """Returns the bytes of a buffer view that is stored by EXT_meshopt_compression.

    where: the view's place in the file, for messages.
    table: the JSON of the extension.
    data: the compressed bytes.

    Errors: AssetError where the library is missing or the data are damaged.
    """
    try:
        import meshoptimizer
    except ImportError:
        raise _missing(file, "EXT_meshopt_compression") from None
    count, stride, mode = table["count"], table["byteStride"], table["mode"]
    kind = table.get("filter", "NONE")
    if mode not in ("ATTRIBUTES", "TRIANGLES", "INDICES") or kind not in ("NONE", *FILTERS):
        raise file.fail(f"{where}: the mode {short(mode)} with the filter {short(kind)} is unknown; save it uncompressed")
    fits = stride % 4 == 0 and 0 < stride <= WIDEST if mode == "ATTRIBUTES" else stride in (2, 4)
    if not fits or stride not in FILTERS.get(kind, (stride,)) or (mode == "TRIANGLES" and count % 3):
        raise file.fail(f"{where}: {count} elements of {stride} bytes cannot be stored as {mode} with the filter {kind}")
    try:
        if mode != "ATTRIBUTES":
            decode = meshoptimizer.decode_index_buffer if mode == "TRIANGLES" else meshoptimizer.decode_index_sequence
            # The library always fills an array of 4 bytes an index.
            return bytes(decode(count, 4, data).astype(f"<u{stride}").tobytes())
        elements: Array = meshoptimizer.decode_vertex_buffer(count, stride, data, dtype=np.dtype((np.void, stride)))
    except (RuntimeError, ValueError):
        raise file.fail(f"{where}: its compressed data are damaged; export the file again") from None
    if kind != "NONE":
        undo = {
            "OCTAHEDRAL": meshoptimizer.decode_filter_oct,
            "QUATERNION": meshoptimizer.decode_filter_quat,
            "EXPONENTIAL": meshoptimizer.decode_filter_exp,
        }[kind]
        # The exponential filter works on each group of 4 bytes, and the stride gives their number.
        elements = undo(elements, count, stride)
    return elements.tobytes()


def draco_primitive(
    file: MeshFile, where: str, data: bytes, numbers: dict[str, int], most: int
) -> tuple[dict[str, Array], Int64 | None]:
    """Returns the attributes of a primitive that KHR_draco_mesh_compression stores, by their names, and the indices (3T,).

    where: the primitive's place in the file, for messages.
    data: the compressed bytes.
    numbers: name of an attribute -> its number in the compressed data.
    most: the largest number of vertices or corners that the file's accessors announce.

    Errors: AssetError where the library is missing or the data are damaged.
    """
    try:
        import DracoPy
    except ImportError:
        raise _missing(file, "KHR_draco_mesh_compression") from None
    try:
        decoded = DracoPy.decode(data)
        stored = {entry["unique_id"]: np.asarray(entry["data"]) for entry in decoded.attributes}
        faces = getattr(decoded, "faces", None)
    except Exception:  # the library raises several types of its own, and some of NumPy's
        raise file.fail(f"{where}: its Draco data are damaged; export the file again") from None
    if (faces is not None and faces.size > most) or any(len(values) > most for values in stored.values()):
        raise file.fail(f"{where}: its Draco data hold more than its accessors announce; export the file again")
    attributes = {}
    for name, number in numbers.items():
        if number not in stored:
            raise file.fail(f"{where}: its Draco data have no attribute {number}, which is its {short(name)}")
        values = stored[number]
        attributes[name] = values.reshape(len(values), -1)
    return attributes, None if faces is None else np.asarray(faces, dtype=np.int64).reshape(-1)


def _missing(file: MeshFile, extension: str) -> AssetError:
    """Returns the error of a file whose library is not installed."""
    return file.fail(f"needs {extension}: install glshade[compressed] to read it, or save the file uncompressed")
