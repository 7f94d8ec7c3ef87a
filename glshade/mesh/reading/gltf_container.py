"""glTF container: the JSON and the buffers of a glTF 2 file, in either of its two forms."""

from __future__ import annotations

import base64
import json
import struct
from typing import Any
from urllib.parse import unquote

from glshade.mesh.reading.file import OUTSIDE, MeshFile, short

# The first bytes of the binary form.
MAGIC = b"glTF"


def opened(file: MeshFile) -> tuple[dict[str, Any], list[bytes]]:
    """Returns the JSON of a glTF file, whose version is checked, and the bytes of every buffer.

    The content decides between the two forms, not the suffix. Errors: AssetError.
    """
    data, binary = file.data, None
    if data[:4] == MAGIC:
        version, length = struct.unpack_from("<II", data, 4)
        if version != 2:
            raise file.fail(f"is glTF {version}; only glTF 2 is supported")
        if length > len(data):
            raise file.fail(f"is truncated: {len(data)} bytes of {length}")
        chunks: dict[bytes, bytes] = {}
        offset = 12
        while offset + 8 <= length:
            size, kind = struct.unpack_from("<I4s", data, offset)
            chunks.setdefault(kind, data[offset + 8 : offset + 8 + size])
            offset += 8 + size
        if b"JSON" not in chunks:
            raise file.fail("is not a GLB file: it has no JSON chunk")
        data, binary = chunks[b"JSON"], chunks.get(b"BIN\0")
    try:
        header = json.loads(data.decode("utf-8-sig"))
    except ValueError as error:
        raise file.fail(f"is not glTF: its JSON cannot be read: {error}") from None
    if not isinstance(header, dict) or "asset" not in header:
        raise file.fail("is not glTF: it has no 'asset'")
    version = str(header["asset"].get("version", "2.0"))
    if not version.startswith("2"):
        raise file.fail(f"is glTF {version}; only glTF 2 is supported")
    buffers = []
    for index, buffer in enumerate(header.get("buffers", [])):
        if "uri" in buffer:
            found = _uri(file, index, buffer["uri"])
        elif index == 0 and binary is not None:
            found = binary
        else:
            raise file.fail(f"buffer {index} has no data")
        if len(found) < buffer["byteLength"]:
            raise file.fail(f"buffer {index} is truncated: {len(found)} bytes of {buffer['byteLength']}")
        buffers.append(found)
    return header, buffers


def _uri(file: MeshFile, index: int, uri: str) -> bytes:
    """Returns the bytes of buffer number `index`: those of a data URI, or of the file that a relative URI names.

    Errors: AssetError where that file is missing or outside.
    """
    if uri.startswith("data:"):
        return base64.b64decode(uri.partition(",")[2])
    name = unquote(uri)
    path = file.beside(name)
    if file.is_outside(path):
        raise file.fail(f"buffers[{index}].uri: '{short(name)}' {OUTSIDE}")
    data = file.read(path)
    if data is None:
        raise file.fail(f"its buffer '{short(name)}' is missing")
    return data
