"""glTF container: the JSON and the buffers of a glTF 2 file, in either of its two forms."""

from __future__ import annotations

import base64
import binascii
import json
import struct
from typing import Any
from urllib.parse import unquote

from glshade.mesh.reading.file import OUTSIDE, MeshFile, short
from glshade.mesh.reading.gltf_shape import checked

# The first bytes of the binary form.
MAGIC = b"glTF"
# The two names of the extension that compresses views of buffers. The second is the first's successor, with the same keys.
MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")


def opened(file: MeshFile) -> tuple[dict[str, Any], list[bytes]]:
    """Returns the JSON of a glTF file and the bytes of every buffer. The version, types and references of the JSON are checked.

    The content decides between the two forms, not the suffix. A buffer that stands only for data which is stored compressed has
    no bytes. Errors: AssetError.
    """
    data, binary = _chunks(file) if file.data[:4] == MAGIC else (file.data, None)
    try:
        header = json.loads(data.decode("utf-8-sig"))
    except json.JSONDecodeError as error:
        raise file.fail(f"is not glTF: its JSON cannot be read at line {error.lineno}, column {error.colno}") from None
    except (ValueError, RecursionError):  # no UTF-8 text, a number of thousands of digits, or too many brackets
        raise file.fail("is not glTF: its JSON cannot be read; export the file again") from None
    if not isinstance(header, dict) or not isinstance(header.get("asset"), dict):
        raise file.fail("is not glTF: it has no 'asset'")
    _check_version(file, header)
    checked(file, header)
    return header, [_buffer(file, index, buffer, binary) for index, buffer in enumerate(header.get("buffers", []))]


def _chunks(file: MeshFile) -> tuple[bytes, bytes | None]:
    """Returns the JSON of a GLB file and its binary chunk, or None where it has none. Errors: AssetError."""
    if len(file.data) < 12:
        raise file.fail(f"is truncated: a GLB file starts with 12 bytes, and this one has {len(file.data)}")
    version, length = struct.unpack_from("<II", file.data, 4)
    if version != 2:
        raise file.fail(f"is glTF {version}; only glTF 2 is supported: convert it, for example with gltf-pipeline")
    if length > len(file.data):
        raise file.fail(f"is truncated: {len(file.data)} bytes of {length}")
    chunks: dict[bytes, bytes] = {}
    offset = 12
    while offset + 8 <= length:
        size, kind = struct.unpack_from("<I4s", file.data, offset)
        if offset + 8 + size > length:
            raise file.fail(f"is damaged: the chunk at byte {offset} has {size} bytes, more than the file")
        chunks.setdefault(kind, file.data[offset + 8 : offset + 8 + size])
        offset += 8 + size
    if b"JSON" not in chunks:
        raise file.fail("is not a GLB file: it has no JSON chunk")
    return chunks[b"JSON"], chunks.get(b"BIN\0")


def _check_version(file: MeshFile, header: dict[str, Any]) -> None:
    """Checks the version of glTF. Errors: AssetError."""
    asset = header["asset"]
    # glTF 1 has tables of named items where glTF 2 has lists, and its version may be missing.
    version = str(asset.get("version", "1" if isinstance(header.get("meshes"), dict) else "2.0"))
    needed = str(asset.get("minVersion", "2.0"))
    if version.partition(".")[0] != "2":
        raise file.fail(f"is glTF {short(version)}; only glTF 2 is supported: convert it, for example with gltf-pipeline")
    if needed != "2.0":
        raise file.fail(f"needs glTF {short(needed)}; only glTF 2.0 is supported")


def _buffer(file: MeshFile, index: int, buffer: dict[str, Any], binary: bytes | None) -> bytes:
    """Returns the bytes of buffer number `index`. binary: the binary chunk of a GLB file. Errors: AssetError."""
    if "uri" in buffer:
        found = _uri(file, index, buffer["uri"])
    elif index == 0 and binary is not None:
        found = binary
    elif any(name in buffer.get("extensions", {}) for name in MESHOPT):
        return b""
    else:
        raise file.fail(f"buffers[{index}] has no data: it names no file, and only the first buffer of a GLB file may do that")
    if len(found) < buffer["byteLength"]:
        raise file.fail(f"buffers[{index}] is truncated: {len(found)} bytes of {buffer['byteLength']}")
    return found


def _uri(file: MeshFile, index: int, uri: str) -> bytes:
    """Returns the bytes of buffer number `index`: those of a data URI, or of the file that a relative URI names.

    Errors: AssetError where that file is missing or outside.
    """
    if uri.startswith("data:"):
        try:
            return base64.b64decode(unquote(uri.partition(",")[2]))
        except (binascii.Error, ValueError):
            raise file.fail(f"buffers[{index}].uri is not valid base64; export the file again") from None
    name = unquote(uri)
    path = file.beside(name)
    if file.is_outside(path):
        raise file.fail(f"buffers[{index}].uri: '{short(name)}' {OUTSIDE}")
    data = file.read(path)
    if data is None:
        raise file.fail(f"its buffer '{short(name)}' is missing; it must lie beside the file")
    return data
