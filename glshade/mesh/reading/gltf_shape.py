"""glTF shape: checks that the JSON of a glTF file has the types and the references that the specification asks for.

The rest of the reader may then look up every table that a number refers to without a check of its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeAlias

from glshade.mesh.reading.file import MeshFile, short

# A check gets a value and its place in the file, and the JSON of the file. It returns None, or the fault in words.
Check: TypeAlias = Callable[[Any, str, dict[str, Any]], str | None]


def checked(file: MeshFile, header: dict[str, Any]) -> None:
    """Checks the parts of a file's JSON that the reader looks at. Unknown keys are left alone.

    header: the JSON of the file.

    Errors: AssetError, which names the place in the file and the value that was expected there.
    """
    fault = _HEADER(header, "", header)
    if fault is not None:
        raise file.fail(fault)


def _wrong(place: str, expected: str, value: Any) -> str:
    """Returns the words of a fault."""
    return f"{place} must be {expected}, not {short(repr(value))}"


def _whole(value: Any, place: str, header: dict[str, Any]) -> str | None:
    """Checks a whole number of 0 or more."""
    is_whole = isinstance(value, int) and not isinstance(value, bool) and value >= 0
    return None if is_whole else _wrong(place, "a whole number of 0 or more", value)


def _number(value: Any, place: str, header: dict[str, Any]) -> str | None:
    """Checks a finite number."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    # A whole number of more than 308 digits has no float64.
    return None if is_number and abs(value) < 2**1023 and math.isfinite(value) else _wrong(place, "a finite number", value)


def _text(value: Any, place: str, header: dict[str, Any]) -> str | None:
    """Checks a text."""
    return None if isinstance(value, str) else _wrong(place, "a text", value)


def _flag(value: Any, place: str, header: dict[str, Any]) -> str | None:
    """Checks true or false."""
    return None if isinstance(value, bool) else _wrong(place, "true or false", value)


def _reference(kind: str) -> Check:
    """Returns the check of a number that refers to an item of one of the file's lists."""

    def check(value: Any, place: str, header: dict[str, Any]) -> str | None:
        items = header.get(kind, ())
        if _whole(value, place, header) is None and isinstance(items, list) and value < len(items):
            return None
        count = len(items) if isinstance(items, list) else 0
        return f"{place} is {short(repr(value))}, but the file has {count} {kind}, numbered from 0"

    return check


def _list(item: Check, length: int | None = None) -> Check:
    """Returns the check of a list.

    item: the check of each item.
    length: optional, the number of items.
    """

    def check(value: Any, place: str, header: dict[str, Any]) -> str | None:
        if not isinstance(value, list) or length not in (None, len(value)):
            return _wrong(place, "a list" if length is None else f"a list of {length} numbers", value)
        for index, entry in enumerate(value):
            fault = item(entry, f"{place}[{index}]", header)
            if fault is not None:
                return fault
        return None

    return check


def _table(required: tuple[str, ...] = (), rest: Check | None = None, **keys: Check) -> Check:
    """Returns the check of a table.

    required: keys that must be there.
    rest: optional, the check of the values of all keys that `keys` does not list.
    keys: key -> the check of its value.
    """

    def check(value: Any, place: str, header: dict[str, Any]) -> str | None:
        if not isinstance(value, dict):
            return _wrong(place or "the JSON", "a table", value)
        for key in required:
            if key not in value:
                return f"{place or 'the JSON'} has no '{key}'"
        for key, entry in value.items():
            test = keys.get(key, rest)
            fault = test(entry, f"{place}.{key}" if place else key, header) if test is not None else None
            if fault is not None:
                return fault
        return None

    return check


_ATTRIBUTES = _table(rest=_reference("accessors"))
_NUMBERS = _list(_number)
_MESHOPT = _table(
    ("buffer", "byteLength", "byteStride", "count", "mode"),
    buffer=_reference("buffers"),
    byteOffset=_whole,
    byteLength=_whole,
    byteStride=_whole,
    count=_whole,
    mode=_text,
    filter=_text,
)
_VIEW = _table(
    ("buffer", "byteLength"),
    buffer=_reference("buffers"),
    byteOffset=_whole,
    byteLength=_whole,
    byteStride=_whole,
    extensions=_table(EXT_meshopt_compression=_MESHOPT, KHR_meshopt_compression=_MESHOPT),
)
_SPARSE = _table(
    ("count", "indices", "values"),
    count=_whole,
    indices=_table(
        ("bufferView", "componentType"), bufferView=_reference("bufferViews"), byteOffset=_whole, componentType=_whole
    ),
    values=_table(("bufferView",), bufferView=_reference("bufferViews"), byteOffset=_whole),
)
_ACCESSOR = _table(
    ("componentType", "count", "type"),
    bufferView=_reference("bufferViews"),
    byteOffset=_whole,
    componentType=_whole,
    normalized=_flag,
    count=_whole,
    type=_text,
    sparse=_SPARSE,
)
_DRACO = _table(("bufferView", "attributes"), bufferView=_reference("bufferViews"), attributes=_table(rest=_whole))
_PRIMITIVE = _table(
    ("attributes",),
    attributes=_ATTRIBUTES,
    indices=_reference("accessors"),
    material=_reference("materials"),
    mode=_whole,
    targets=_list(_ATTRIBUTES),
    extensions=_table(KHR_draco_mesh_compression=_DRACO),
)
_NODE = _table(
    name=_text,
    mesh=_reference("meshes"),
    skin=_reference("skins"),
    camera=_reference("cameras"),
    children=_list(_reference("nodes")),
    matrix=_list(_number, 16),
    translation=_list(_number, 3),
    rotation=_list(_number, 4),
    scale=_list(_number, 3),
    weights=_NUMBERS,
    extensions=_table(
        EXT_mesh_gpu_instancing=_table(("attributes",), attributes=_ATTRIBUTES),
        KHR_lights_punctual=_table(("light",), light=_whole),
        KHR_node_visibility=_table(visible=_flag),
    ),
)
_SKIN = _table(("joints",), joints=_list(_reference("nodes")), inverseBindMatrices=_reference("accessors"))
_CAMERA = _table(
    ("type",),
    name=_text,
    type=_text,
    perspective=_table(("yfov", "znear"), yfov=_number, znear=_number, zfar=_number, aspectRatio=_number),
    orthographic=_table(("xmag", "ymag", "zfar", "znear"), xmag=_number, ymag=_number, zfar=_number, znear=_number),
)
_LIGHT = _table(
    ("type",),
    name=_text,
    type=_text,
    color=_list(_number, 3),
    intensity=_number,
    range=_number,
    spot=_table(innerConeAngle=_number, outerConeAngle=_number),
)
_HEADER = _table(
    asset=_table(version=_text, minVersion=_text),
    extensionsRequired=_list(_text),
    extensionsUsed=_list(_text),
    extensions=_table(KHR_lights_punctual=_table(lights=_list(_LIGHT))),
    scene=_whole,
    scenes=_list(_table(nodes=_list(_reference("nodes")))),
    nodes=_list(_NODE),
    meshes=_list(_table(("primitives",), name=_text, primitives=_list(_PRIMITIVE), weights=_NUMBERS)),
    skins=_list(_SKIN),
    cameras=_list(_CAMERA),
    accessors=_list(_ACCESSOR),
    bufferViews=_list(_VIEW),
    buffers=_list(_table(("byteLength",), byteLength=_whole, uri=_text)),
    materials=_list(_table()),
    samplers=_list(_table()),
    textures=_list(_table(source=_reference("images"), sampler=_reference("samplers"))),
    images=_list(_table(uri=_text, bufferView=_reference("bufferViews"))),
    animations=_list(_table()),
)
