"""glTF geometry: the vertices of a primitive, its morph targets and its skin, posed as the file leaves them (glTF 2.0, 3.7)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from glshade.arrays import Array, Float64, Int64
from glshade.mesh.reading.file import MeshFile
from glshade.mesh.reading.gltf_accessors import Accessors
from glshade.mesh.reading.gltf_compressed import draco_primitive

POINTS, LINES, LINE_LOOP, LINE_STRIP, TRIANGLES, TRIANGLE_STRIP, TRIANGLE_FAN = range(7)
# Attribute -> the numbers of its components.
WIDTHS = {"POSITION": (3,), "NORMAL": (3,), "TANGENT": (4,)}
# The starts of the names of further attributes that are read.
READ = ("TEXCOORD_", "COLOR_", "JOINTS_", "WEIGHTS_")
# The number of vertices whose matrices of a skin are made at once, to bound the memory [each takes 128 bytes].
BLOCK = 1 << 16


@dataclass(frozen=True, eq=False)
class Geometry:
    """The vertices of a primitive.

    mode: the number of its topology, from POINTS to TRIANGLE_FAN.
    order: (N,) the vertices in the order in which the topology connects them.
    attributes: name such as "POSITION", "NORMAL", "TANGENT", "TEXCOORD" or "COLOR" -> values (V, C).
    targets: for each morph target, the same names -> what a weight of 1 adds (V, C).
    joints: (V, 4 S) the numbers of joints in the skin, of S sets; None where the primitive has no skin.
    weights: (V, 4 S) the weights of these joints.
    """

    mode: int
    order: Int64
    attributes: dict[str, Float64]
    targets: list[dict[str, Float64]] = field(default_factory=list)
    joints: Int64 | None = None
    weights: Float64 | None = None


def geometry(accessors: Accessors, primitive: dict[str, Any], uv_set: int, where: str) -> Geometry | None:
    """Returns the vertices of a primitive; None for one without positions, which glTF does not draw.

    primitive: the JSON of the primitive.
    uv_set: the number n of the attribute TEXCOORD_n that its material reads.
    where: the primitive's place in the file, for messages.

    Errors: AssetError.
    """
    given = primitive["attributes"]
    mode = primitive.get("mode", TRIANGLES)
    if mode > TRIANGLE_FAN:
        raise accessors.file.fail(f"{where}.mode is {mode}, which glTF does not have")
    if "POSITION" not in given:
        return None
    wanted = {name: name for name in WIDTHS} | {f"TEXCOORD_{uv_set}": "TEXCOORD", "COLOR_0": "COLOR"}
    packed, indices = _draco(accessors, primitive, where)

    def values(name: str, columns: tuple[int, ...], fractions: bool = False) -> Float64:
        if name in packed:
            return accessors.scaled(given[name], packed[name], fractions)
        return accessors.floats(given[name], columns, fractions)

    attributes: dict[str, Float64] = {}
    for name, short in wanted.items():
        if name in given:
            columns = WIDTHS.get(short, (2,) if short == "TEXCOORD" else (3, 4))
            attributes[short] = values(name, columns, fractions=short == "COLOR")
    count = len(attributes["POSITION"])
    for name, array in attributes.items():
        if len(array) != count:
            raise accessors.file.fail(f"{where}: {name} has {len(array)} elements, but POSITION has {count}")
    if indices is None:
        indices = accessors.integers(primitive["indices"])[:, 0] if "indices" in primitive else np.arange(count)
    if len(indices) and indices.max() >= count:
        raise accessors.file.fail(f"{where}.indices: index {indices.max()} is out of range: {count} vertices")
    targets = [_target(accessors, target, wanted, count, where) for target in primitive.get("targets", ())]
    joints, weights = _influences(accessors, given, packed, values, count, where)
    return Geometry(mode, indices, attributes, targets, joints, weights)


def size(accessors: Accessors, primitive: dict[str, Any]) -> tuple[int, int]:
    """Returns the number of corners that a primitive's topology has, and the number of values of vertices that it reads."""
    given = primitive["attributes"]
    read = [index for name, index in given.items() if name in WIDTHS or name.startswith(READ)]
    read += [index for target in primitive.get("targets", ()) for index in target.values()]
    first = primitive.get("indices", given.get("POSITION"))
    corners = 0 if first is None else accessors.count(first)
    return corners * (3 if primitive.get("mode", TRIANGLES) > TRIANGLES else 1), sum(map(accessors.count, read))


def _draco(accessors: Accessors, primitive: dict[str, Any], where: str) -> tuple[dict[str, Array], Int64 | None]:
    """Returns the attributes and indices that a primitive stores by Draco alone; none where plain accessors hold them.

    Errors: AssetError.
    """
    table = primitive.get("extensions", {}).get("KHR_draco_mesh_compression")
    used = [*primitive["attributes"].values(), *([primitive["indices"]] if "indices" in primitive else [])]
    # Plain accessors beside the compressed data are a fallback, which needs no library and loses nothing.
    if table is None or all(map(accessors.has_data, used)):
        return {}, None
    numbers = {name: number for name, number in table["attributes"].items() if name in primitive["attributes"]}
    most = max(map(accessors.count, used))
    data = bytes(accessors.view(table["bufferView"]))
    return draco_primitive(accessors.file, where, data, numbers, most)


def _target(accessors: Accessors, target: dict[str, int], wanted: dict[str, str], count: int, where: str) -> dict[str, Float64]:
    """Returns the values of a morph target (V, C) by the names of `Geometry.attributes`. Errors: AssetError."""
    result = {}
    for name, index in target.items():
        if name in wanted:
            columns = (2,) if wanted[name] == "TEXCOORD" else (3, 4) if wanted[name] == "COLOR" else (3,)
            result[wanted[name]] = accessors.floats(index, columns)
            if len(result[wanted[name]]) != count:
                raise accessors.file.fail(f"{where}.targets: {name} has {accessors.count(index)} elements, not {count}")
    return result


def _influences(
    accessors: Accessors, given: dict[str, int], packed: dict[str, Array], values: Any, count: int, where: str
) -> tuple[Int64 | None, Float64 | None]:
    """Returns the joints and the weights (V, 4 S) of a primitive, None where it has none. Errors: AssetError."""
    sets = [number for number in range(len(given)) if f"JOINTS_{number}" in given and f"WEIGHTS_{number}" in given]
    if not sets:
        return None, None
    joints = [
        packed[name].astype(np.int64) if name in packed else accessors.integers(given[name], 4)
        for name in (f"JOINTS_{number}" for number in sets)
    ]
    weights = [values(f"WEIGHTS_{number}", (4,), fractions=True) for number in sets]
    if any(len(array) != count for array in (*joints, *weights)):
        raise accessors.file.fail(f"{where}: its joints and weights do not have one element for each of {count} positions")
    return np.concatenate(joints, axis=1), np.concatenate(weights, axis=1)


def morphed(shape: Geometry, weights: list[float]) -> Geometry:
    """Returns the geometry with its morph targets added (glTF 2.0, 3.7.2.2). weights: one for each target; others are 0."""
    attributes = dict(shape.attributes)
    for target, weight in zip(shape.targets, weights, strict=False):
        for name, offset in target.items():
            if weight and name in attributes:
                sum_ = attributes[name].copy()
                # Tangents are moved in their first three components, and colours may lack the fourth.
                width = min(offset.shape[1], sum_.shape[1])
                sum_[:, :width] += weight * offset[:, :width]
                attributes[name] = sum_
    if "COLOR" in attributes:
        attributes["COLOR"] = np.clip(attributes["COLOR"], 0.0, 1.0)
    return replace(shape, attributes=attributes, targets=[])


def skinned(file: MeshFile, shape: Geometry, joints: Float64, where: str) -> Geometry:
    """Returns the geometry in file space, moved by the joints of its skin (glTF 2.0, 3.7.3.3).

    joints: (J, 4, 4), for each joint of the skin, the transform from the mesh's space to file space.
    where: the primitive's place in the file, for messages.

    Errors: AssetError for a vertex that names a joint which the skin does not have.
    """
    if shape.joints is None or shape.weights is None:
        return shape
    weights = np.where(np.isfinite(shape.weights), np.maximum(shape.weights, 0.0), 0.0)
    wrong = (weights > 0) & ((shape.joints < 0) | (shape.joints >= len(joints)))
    if wrong.any():
        bad = int(np.flatnonzero(wrong.any(axis=1))[0])
        raise file.fail(
            f"{where}: vertex {bad} names joint {shape.joints[bad][wrong[bad]][0]}, but its skin has {len(joints)} joints"
        )
    numbers = np.where(weights > 0, shape.joints, 0)
    # The weights of a vertex should add up to 1. A vertex without any weight follows the skin's first joint.
    total = weights.sum(axis=1, keepdims=True)
    weights = np.divide(weights, total, out=np.zeros_like(weights), where=total > 0)
    weights[total[:, 0] == 0, 0] = 1.0
    attributes = dict(shape.attributes)
    moved = {name: attributes[name].copy() for name in ("POSITION", "NORMAL", "TANGENT") if name in attributes}
    for start in range(0, len(numbers), BLOCK):
        rows = slice(start, start + BLOCK)
        matrix = np.zeros((len(numbers[rows]), 3, 4))
        for column in range(numbers.shape[1]):
            matrix += weights[rows, column, None, None] * joints[numbers[rows, column], :3]
        linear = matrix[:, :, :3]
        for name, array in moved.items():
            kind = _cofactors(linear) if name == "NORMAL" else linear
            array[rows, :3] = np.einsum("vij,vj->vi", kind, attributes[name][rows, :3])
        moved["POSITION"][rows] += matrix[:, :, 3]
    return replace(shape, attributes=attributes | moved, joints=None, weights=None)


def transformed(shape: Geometry, transform: Float64) -> Geometry:
    """Returns the geometry with its positions transformed (4, 4), and without normals. It suits transforms that flatten it."""
    attributes = {name: array for name, array in shape.attributes.items() if name not in ("NORMAL", "TANGENT")}
    attributes["POSITION"] = attributes["POSITION"] @ transform[:3, :3].T + transform[:3, 3]
    return replace(shape, attributes=attributes)


def _cofactors(linear: Float64) -> Float64:
    """Returns matrices (V, 3, 3) that transform normals as `linear` (V, 3, 3) transforms positions, up to a positive factor.

    The matrix of cofactors is the inverse transpose times the determinant, and exists for every matrix.
    """
    a, b, c = linear[:, :, 0], linear[:, :, 1], linear[:, :, 2]
    columns = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=2)
    sign = np.where(np.einsum("vi,vi->v", a, columns[:, :, 0]) < 0, -1.0, 1.0)
    result: Float64 = columns * sign[:, None, None]
    return result


def triangles(shape: Geometry) -> Int64:
    """Returns the triangles (T, 3) of a geometry of triangles, each counter-clockwise as glTF lists it (glTF 2.0, 3.7.2.1)."""
    order = shape.order
    if shape.mode == TRIANGLES:
        return order[: len(order) // 3 * 3].reshape(-1, 3)
    if len(order) < 3:
        return np.zeros((0, 3), dtype=np.int64)
    number = np.arange(len(order) - 2)
    if shape.mode == TRIANGLE_FAN:
        corners = np.stack([number + 1, number + 2, np.zeros_like(number)], axis=1)
    else:
        odd = number % 2
        corners = np.stack([number, number + 1 + odd, number + 2 - odd], axis=1)
    result = order[corners]
    # Strips join their parts by triangles with two equal corners, which are not drawn.
    a, b, c = result.T
    proper: Int64 = result[(a != b) & (b != c) & (c != a)]
    return proper
