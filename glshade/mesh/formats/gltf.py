"""glTF: the JSON form of glTF 2, with its buffers in other files or in data URIs. The nodes of its scene become parts."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import numpy as np

from glshade.arrays import Float64
from glshade.mesh.mesh import Mesh
from glshade.mesh.reading import gltf_material
from glshade.mesh.reading.colours import with_alpha
from glshade.mesh.reading.contents import Material
from glshade.mesh.reading.file import MeshFile
from glshade.mesh.reading.gltf_container import opened
from glshade.mesh.reading.parser import parse

_TRIANGLES, _STRIP = 4, 5
_COMPRESSED = ("KHR_draco_mesh_compression", "EXT_meshopt_compression")


def read(file: MeshFile) -> None:
    """Adds a part for each primitive of each node of a glTF scene; nodes with one mesh share it. Errors: AssetError."""
    header, buffers = opened(file)
    for extension in header.get("extensionsRequired", ()):
        if extension in _COMPRESSED:
            raise file.fail(f"needs the glTF extension {extension}, which is not supported; save it uncompressed")
    accessors = header.get("accessors", [])

    # trimesh gets the primitives that consist of triangles, in meshes whose names are their numbers. Attributes whose names
    # start with "_" come back unchanged. Nodes are not given to trimesh, because its scene graph loses the children of cameras.
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
    _check_size(file, accessors, buffers, [primitive for _, primitive in kept])
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
        """Returns an accessor's values as float64. Integers marked as normalized are fractions (glTF 2.0, 3.6.2.2)."""
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
            uvs[:, 1] = 1 - uvs[:, 1]  # in glTF v = 0 is the top of the picture
        if "_COLOUR" in attributes:
            colours = with_alpha(values(extra["_COLOUR"], attributes["_COLOUR"]))  # they are linear (glTF 2.0, 3.7.2.1)
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


def _check_size(
    file: MeshFile, accessors: list[dict[str, Any]], buffers: list[bytes], primitives: list[dict[str, Any]]
) -> None:
    """Checks the number of triangles before they are read. Primitives may share accessors, and an accessor needs no data.

    Errors: AssetError for more triangles than the file stores one by one, and than the limits allow.
    """
    used = [accessors[p["indices"] if "indices" in p else p["attributes"]["POSITION"]]["count"] for p in primitives]
    vertices = [accessors[index]["count"] for p in primitives for index in p["attributes"].values()]
    # An index takes at least one byte. A vertex takes more, and it may be shared by six triangles.
    count = max(sum(used), sum(vertices) // 2)
    if count > max(3 * file.limits.max_triangles, len(file.data) + sum(map(len, buffers))):
        raise file.fail(
            f"its meshes have {count // 3:,} triangles, more than it stores; {file.limits.max_triangles:,} are allowed: "
            "see --max-triangles"
        )


def _nodes(file: MeshFile, header: dict[str, Any]) -> Iterator[tuple[str | None, int, Float64]]:
    """Yields (name, number of the mesh, transform (4, 4) to file space) for every node with a mesh in the scene of the file.

    Errors: AssetError.
    """
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
    # The nodes are visited depth first in the order of the file, and without recursion, because a chain of nodes may be longer
    # than Python's stack is deep.
    waiting: list[tuple[int, Float64, int | None]] = [(root, np.eye(4), None) for root in reversed(roots)]
    # Node -> the node from which it was reached.
    seen: dict[int, int | None] = {}
    while waiting:
        index, parent, above = waiting.pop()
        if index in seen:
            while above is not None and above != index:
                above = seen[above]
            if above is not None:
                raise file.fail(f"its nodes form a cycle: node {index} is its own ancestor")
            raise file.fail(f"node {index} has two parents; glTF nodes form a tree")
        if not 0 <= index < len(nodes):
            raise file.fail(f"node {index} does not exist")
        seen[index] = above
        node = nodes[index]
        with np.errstate(all="ignore"):
            transform = parent @ _transform(node)
        if not np.isfinite(transform).all():
            raise file.fail(f"node {index} has a transform that is not finite")
        if "mesh" in node:
            yield node.get("name"), node["mesh"], transform
        waiting += [(child, transform, index) for child in reversed(node.get("children", []))]


def _transform(node: dict[str, Any]) -> Float64:
    """Returns the transform (4, 4) from a node to its parent: its matrix, or its translation, rotation and scale."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T  # glTF stores it column by column
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
