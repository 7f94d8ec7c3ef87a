"""glTF: glTF 2 with its scene's nodes, as .gltf with buffers beside it or as one .glb."""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Iterator
from typing import Any
from urllib.parse import unquote

import numpy as np

from glshade.mesh.formats import gltf_material
from glshade.mesh.formats.colours import with_alpha
from glshade.mesh.formats.contents import Material
from glshade.mesh.formats.file import File
from glshade.mesh.formats.parser import parse
from glshade.mesh.mesh import Float64, Mesh

_TRIANGLES, _STRIP = 4, 5
_COMPRESSED = ("KHR_draco_mesh_compression", "EXT_meshopt_compression")


def read(file: File) -> None:
    header, buffers = _header(file)
    for extension in header.get("extensionsRequired", ()):
        if extension in _COMPRESSED:
            raise file.fail(f"needs the glTF extension {extension}, which is not supported; save it uncompressed")
    accessors = header.get("accessors", [])

    # Only triangles are handed to trimesh, under names by which what it returns can be told apart; its scene graph
    # loses the children of cameras, so nodes are walked here. Attributes that start with _ come back as they are.
    kept: list[tuple[int, dict[str, Any]]] = []
    others = 0
    meshes = []
    for number, mesh in enumerate(header.get("meshes", [])):
        primitives = []
        for primitive in mesh["primitives"]:
            if primitive.get("mode", _TRIANGLES) not in (_TRIANGLES, _STRIP):
                others += 1
                continue
            attributes = {key: value for key, value in primitive["attributes"].items() if key in ("POSITION", "NORMAL")}
            uv_set = f"TEXCOORD_{gltf_material.uv_set(header, primitive)}"
            for key, source in (("_UV", uv_set), ("_COLOUR", "COLOR_0")):
                if source in primitive["attributes"]:
                    attributes[key] = primitive["attributes"][source]
            used = [*attributes.values(), *([primitive["indices"]] if "indices" in primitive else [])]
            for index in used:
                if "sparse" in accessors[index]:
                    raise file.fail(f"accessor {index} is sparse, which is not supported; save it plain")
            entry = {key: value for key, value in primitive.items() if key in ("indices", "mode", "material")}
            primitives.append(entry | {"attributes": attributes})
            kept.append((number, primitives[-1]))
        meshes.append({"name": f"{number}", "primitives": primitives})
    if not kept:
        raise file.fail("holds only points or lines, no triangles" if others else "holds no triangles")
    plain = {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": str(index), "byteLength": len(data)} for index, data in enumerate(buffers)],
        "bufferViews": header.get("bufferViews", []),
        "accessors": [{k: v for k, v in accessor.items() if k != "sparse"} for accessor in accessors],
        "meshes": meshes,
    }
    resolver = {str(index): data for index, data in enumerate(buffers)}
    parsed = parse("gltf", json.dumps(plain).encode(), resolver=resolver, skip_materials=True)
    geometries = list(parsed["geometry"].values())
    assert len(geometries) == len(kept)

    def values(raw: Any, accessor: int) -> Float64:
        """As floats; integers marked as normalized are fractions of their range (glTF 2.0, 3.6.2.2)."""
        raw = np.asarray(raw)
        if raw.dtype.kind == "f" or not accessors[accessor].get("normalized", False):
            return np.array(raw, dtype=np.float64)
        fractions: Float64 = np.maximum(raw / np.iinfo(raw.dtype).max, -1.0)
        return fractions

    built: dict[int, list[tuple[Mesh, Material | None]]] = {}
    materials: dict[int, Material] = {}
    for (number, primitive), geometry in zip(kept, geometries, strict=True):
        attributes = primitive["attributes"]
        extra = geometry.get("vertex_attributes", {})
        uvs = colours = normals = None
        if "_UV" in attributes:
            uvs = values(extra["_UV"], attributes["_UV"])
            uvs[:, 1] = 1 - uvs[:, 1]  # glTF has v = 0 at the top of the picture
        if "_COLOUR" in attributes:
            colours = with_alpha(values(extra["_COLOUR"], attributes["_COLOUR"]))  # linear already (glTF 2.0, 3.7.2.1)
        if "NORMAL" in attributes:
            normals = values(geometry["vertex_normals"], attributes["NORMAL"])
        positions = values(geometry["vertices"], attributes["POSITION"])
        where = f"mesh {number}: "
        mesh = file.build(where, positions, np.asarray(geometry["faces"]), normals=normals, uvs=uvs, colours=colours)
        material = None
        if "material" in primitive:
            index = primitive["material"]
            if index not in materials:
                materials[index] = gltf_material.material(file, header, buffers, header["materials"][index])
            material = materials[index]
        built.setdefault(number, []).append((mesh, material))

    stored: dict[int, int] = {}
    for name, number, transform in _nodes(file, header):
        for index, (mesh, material) in enumerate(built.get(number, [])):
            title = name or header["meshes"][number].get("name") or f"mesh {number}"
            if len(built[number]) > 1:
                title = f"{title}.{index + 1}"
            known = stored.get(id(mesh))
            file.contents.add(title, mesh if known is None else known, material, transform)
            stored.setdefault(id(mesh), len(file.contents.meshes) - 1)


def _header(file: File) -> tuple[dict[str, Any], list[bytes]]:
    """The JSON part, checked for its version, and the bytes of every buffer."""
    data, binary = file.data, None
    if data[:4] == b"glTF":
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
    elif file.path.suffix.lower() == ".glb":
        raise file.fail("is not a GLB file: it does not start with 'glTF'")
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
            found = _uri(file, buffer["uri"])
            if found is None:
                raise file.fail(f"its buffer '{unquote(buffer['uri'])}' is missing")
        elif index == 0 and binary is not None:
            found = binary
        else:
            raise file.fail(f"buffer {index} has no data")
        if len(found) < buffer["byteLength"]:
            raise file.fail(f"buffer {index} is truncated: {len(found)} bytes of {buffer['byteLength']}")
        buffers.append(found)
    return header, buffers


def _uri(file: File, uri: str) -> bytes | None:
    if uri.startswith("data:"):
        return base64.b64decode(uri.partition(",")[2])
    return file.read(file.beside(unquote(uri)))


def _nodes(file: File, header: dict[str, Any]) -> Iterator[tuple[str | None, int, Float64]]:
    """Name, mesh and transform to the file's space of every node with a mesh in the file's scene."""
    nodes = header.get("nodes", [])
    scenes = header.get("scenes", [])
    children = {child for node in nodes for child in node.get("children", [])}
    if scenes:
        roots = scenes[header.get("scene", 0)].get("nodes", [])
    else:
        roots = [index for index in range(len(nodes)) if index not in children]
        if nodes and not roots:
            raise file.fail("its nodes form a cycle")
    if not nodes:
        yield from ((None, number, np.eye(4)) for number in range(len(header.get("meshes", []))))
    # Depth first, in the file's order, without recursion: a chain of nodes may be longer than Python's stack.
    waiting: list[tuple[int, Float64, tuple[int, ...]]] = [(root, np.eye(4), ()) for root in reversed(roots)]
    seen: set[int] = set()
    while waiting:
        index, parent, ancestors = waiting.pop()
        if index in ancestors:
            raise file.fail(f"its nodes form a cycle: node {index} is its own ancestor")
        if index in seen:
            raise file.fail(f"node {index} has two parents; glTF nodes form a tree")
        if not 0 <= index < len(nodes):
            raise file.fail(f"node {index} does not exist")
        seen.add(index)
        node = nodes[index]
        transform = parent @ _transform(node)
        if not np.isfinite(transform).all():
            raise file.fail(f"node {index} has a transform that is not finite")
        if "mesh" in node:
            yield node.get("name"), node["mesh"], transform
        below = (*ancestors, index)
        waiting += [(child, transform, below) for child in reversed(node.get("children", []))]


def _transform(node: dict[str, Any]) -> Float64:
    """(4, 4) to the parent's space: the node's matrix, or T R S."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T  # stored column by column
    result = np.eye(4)
    x, y, z, w = np.array(node.get("rotation", (0.0, 0.0, 0.0, 1.0)), dtype=np.float64)
    norm = x * x + y * y + z * z + w * w
    s = 2 / norm if norm > 0 else 0.0
    rotation = np.array(
        [
            [1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
            [s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)],
            [s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)],
        ]
    )
    result[:3, :3] = rotation * np.array(node.get("scale", (1.0, 1.0, 1.0)), dtype=np.float64)
    result[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return result
