"""glTF nodes: the tree of nodes of a glTF file, with the transform of every node to file space (glTF 2.0, 3.5)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from glshade.arrays import Array, Float64
from glshade.limits import MOST_INSTANCES
from glshade.mesh.reading.file import MeshFile
from glshade.mesh.reading.gltf_accessors import Accessors

# The largest element of the last row of a node's matrix that counts as a rounding error of 0, and of 1 in the corner.
AFFINE = 1e-5
# A transform flattens space if its columns, made unit, span a smaller volume than this.
FLAT = 1e-9


class Nodes:
    """The nodes of a file.

    tables: the JSON of every node.
    world: (N, 4, 4), the transform of every node to file space.
    parents: (N,), the number of every node's parent; -1 where it has none.
    """

    def __init__(self, file: MeshFile, header: dict[str, Any]) -> None:
        """Multiplies the transforms along the tree.

        header: the JSON of the file, whose shape is checked.

        Errors: AssetError if the nodes form no tree, or a transform is not affine or not finite.
        """
        self.file, self.header = file, header
        self.tables: list[dict[str, Any]] = header.get("nodes", [])
        self.parents = self._parents()
        local = self._local()
        self.world = local
        reached = 0
        with np.errstate(all="ignore"):
            for index in self._downward(np.flatnonzero(self.parents < 0).tolist()):
                reached += 1
                parent = self.parents[index]
                if parent >= 0:
                    self.world[index] = self.world[parent] @ local[index]
        if reached < len(self.tables):
            raise file.fail(f"its nodes form a cycle: node {self._in_cycle()} is its own ancestor")
        wrong = ~np.isfinite(self.world).all(axis=(1, 2))
        if wrong.any():
            raise file.fail(f"nodes[{int(np.argmax(wrong))}] has a transform that is not finite")

    def drawn(self) -> Iterator[int]:
        """Yields the number of every visible node of the file's scene, depth first in the order of the file.

        The scene is the one that the file chooses, or else its first. A file without scenes shows all its nodes. A node that
        KHR_node_visibility hides is left out with all its children.
        """
        scenes = self.header.get("scenes", [])
        chosen = self.header.get("scene", 0)
        if scenes and chosen >= len(scenes):
            raise self.file.fail(f"scene is {chosen}, but the file has {len(scenes)} scenes, numbered from 0")
        if scenes:
            roots = scenes[chosen].get("nodes", [])
        else:
            roots = np.flatnonzero(self.parents < 0).tolist()
        # A scene may name a node twice, or name a child of another of its nodes; each node is drawn once.
        yield from self._downward(list(dict.fromkeys(roots)), seen=set())

    def flattened(self, index: int) -> bool:
        """Returns whether the node's transform flattens space, as one with a scale of 0 does."""
        return is_flat(self.world[index])

    def _parents(self) -> Array:
        """Returns the number of every node's parent (N,); -1 where it has none. Errors: AssetError for two parents."""
        parents = np.full(len(self.tables), -1, dtype=np.int64)
        for index, node in enumerate(self.tables):
            for child in node.get("children", ()):
                if parents[child] >= 0:
                    raise self.file.fail(
                        f"nodes[{child}] has two parents, nodes[{parents[child]}] and nodes[{index}]; glTF nodes form a tree"
                    )
                parents[child] = index
        return parents

    def _downward(self, roots: list[int], seen: set[int] | None = None) -> Iterator[int]:
        """Yields roots and their descendants, every node after its parent.

        There is no recursion, because a chain of nodes may be longer than Python's stack is deep.
        seen: optional, an empty set. With it, hidden nodes are left out with their descendants, and each node comes once.
        """
        waiting = roots[::-1]
        while waiting:
            index = waiting.pop()
            node = self.tables[index]
            if seen is not None:
                if index in seen or not _is_visible(node):
                    continue
                seen.add(index)
            yield index
            waiting.extend(reversed(node.get("children", ())))

    def _in_cycle(self) -> int:
        """Returns the number of a node that is its own ancestor, where there is one."""
        visited = set(self._downward(np.flatnonzero(self.parents < 0).tolist()))
        index = next(index for index in range(len(self.tables)) if index not in visited)
        # The node's ancestors lead into the cycle, so that after as many steps as there are nodes one is in it.
        for _ in self.tables:
            index = int(self.parents[index])
        return index

    def _local(self) -> Float64:
        """Returns the transforms (N, 4, 4) of all nodes to their parents: the matrix, or translation, rotation and scale.

        Errors: AssetError for a matrix that is not affine.
        """
        count = len(self.tables)
        given = {
            "translation": np.zeros((count, 3)),
            "rotation": np.tile([0.0, 0, 0, 1], (count, 1)),
            "scale": np.ones((count, 3)),
        }
        matrices = []
        for index, node in enumerate(self.tables):
            for key, values in given.items():
                if key in node:
                    values[index] = node[key]
            if "matrix" in node:
                matrices.append(index)
        local = composed(given["translation"], given["rotation"], given["scale"])
        for index in matrices:
            # glTF stores a matrix column by column.
            matrix = np.array(self.tables[index]["matrix"], dtype=np.float64).reshape(4, 4).T
            if np.abs(matrix[3] - [0, 0, 0, 1]).max() > AFFINE:
                raise self.file.fail(
                    f"nodes[{index}].matrix is not affine: its last row is {matrix[3].tolist()}, not [0, 0, 0, 1]"
                )
            matrix[3] = 0, 0, 0, 1
            local[index] = matrix
        return local


def composed(translation: Float64, rotation: Float64, scale: Float64) -> Float64:
    """Returns transforms (N, 4, 4) that scale, then rotate, then move.

    translation: (N, 3).
    rotation: (N, 4), quaternions x, y, z, w of any length; a quaternion of length 0 does not rotate.
    scale: (N, 3).
    """
    x, y, z, w = rotation.T
    norm = x * x + y * y + z * z + w * w
    s = np.divide(2.0, norm, out=np.zeros(len(norm)), where=norm > 0)
    result = np.zeros((len(norm), 4, 4))
    result[:, 0, 0], result[:, 0, 1], result[:, 0, 2] = 1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)
    result[:, 1, 0], result[:, 1, 1], result[:, 1, 2] = s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)
    result[:, 2, 0], result[:, 2, 1], result[:, 2, 2] = s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)
    result[:, :3, :3] *= scale[:, None, :]
    result[:, :3, 3] = translation
    result[:, 3, 3] = 1
    return result


def instances(accessors: Accessors, node: dict[str, Any]) -> Float64 | None:
    """Returns the transforms (N, 4, 4) of the copies of a node's mesh, to the node, by EXT_mesh_gpu_instancing.

    None stands for a node without the extension. Errors: AssetError.
    """
    extension = node.get("extensions", {}).get("EXT_mesh_gpu_instancing")
    if extension is None:
        return None
    given = extension["attributes"]
    kinds = {"TRANSLATION": (3, (0.0, 0.0, 0.0)), "ROTATION": (4, (0.0, 0.0, 0.0, 1.0)), "SCALE": (3, (1.0, 1.0, 1.0))}
    counts = {accessors.count(given[name]) for name in kinds if name in given}
    if len(counts) > 1:
        raise accessors.file.fail(
            f"EXT_mesh_gpu_instancing: its attributes have {sorted(counts)} elements, not the same number"
        )
    count = counts.pop() if counts else 0
    if count > MOST_INSTANCES:
        raise accessors.file.fail(f"EXT_mesh_gpu_instancing draws {count:,} copies of a mesh; {MOST_INSTANCES:,} are allowed")
    parts = [
        accessors.floats(given[name], (width,)) if name in given else np.tile(default, (count, 1))
        for name, (width, default) in kinds.items()
    ]
    return composed(*parts)


def is_flat(transform: Float64) -> bool:
    """Returns whether a transform (4, 4) flattens space: its columns, made unit, span a volume below FLAT."""
    length = np.linalg.norm(transform[:3, :3], axis=0)
    return not bool(np.all(length > 0)) or abs(np.linalg.det(transform[:3, :3] / length)) < FLAT


def _is_visible(node: dict[str, Any]) -> bool:
    """Returns whether KHR_node_visibility shows a node."""
    return bool(node.get("extensions", {}).get("KHR_node_visibility", {}).get("visible", True))
