"""glTF nodes: the tree of nodes, its scenes, instances and extensions."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glshade.errors import AssetError, AssetWarning
from glshade.mesh.file import load
from glshade.mesh.model import MeshPart
from tests.support.gltf_file import TRIANGLE, GltfFile


def parts(tmp_path: Path, file: GltfFile) -> tuple[MeshPart, ...]:
    return load(file.write(tmp_path / "a.glb")).parts


def tree(nodes: list[dict[str, Any]], **header: Any) -> GltfFile:
    """Returns a file with these nodes, and one triangle as its mesh."""
    file = GltfFile(nodes=nodes, **header)
    return file.one(file.primitive(POSITION=TRIANGLE))


def named(found: tuple[MeshPart, ...]) -> list[str]:
    return [part.name for part in found]


def test_the_scene_of_the_file_is_drawn_and_no_other(tmp_path: Path) -> None:
    nodes: list[dict[str, Any]] = [{"name": name, "mesh": 0} for name in "abc"]
    scenes = [{"nodes": [0]}, {"nodes": [2, 1]}]
    assert named(parts(tmp_path, tree(nodes, scenes=scenes, scene=1))) == ["c", "b"]
    assert named(parts(tmp_path, tree(nodes, scenes=scenes))) == ["a"]
    assert named(parts(tmp_path, tree(nodes))) == ["a", "b", "c"]


def test_names_are_unique_and_stable(tmp_path: Path) -> None:
    file = tree([{"mesh": 0}, {"mesh": 0}, {"name": "x", "mesh": 0}, {"name": "x", "mesh": 0}])
    file.header["meshes"][0]["name"] = "wheel"
    assert named(parts(tmp_path, file)) == ["wheel", "wheel.2", "x", "x.2"]
    file.header["meshes"][0]["primitives"] *= 2
    assert named(parts(tmp_path, file))[:3] == ["wheel.1", "wheel.2", "wheel.1.2"]


def test_a_matrix_that_is_not_affine_is_named(tmp_path: Path) -> None:
    matrix = np.eye(4)
    matrix[3] = 0, 0, 0.5, 1
    with pytest.raises(AssetError, match=r"nodes\[0\]\.matrix is not affine: its last row is \[0\.0, 0\.0, 0\.5, 1\.0\]"):
        parts(tmp_path, tree([{"mesh": 0, "matrix": matrix.T.reshape(-1).tolist()}]))
    matrix[3] = 0, 0, 1e-7, 1
    (part,) = parts(tmp_path, tree([{"mesh": 0, "matrix": matrix.T.reshape(-1).tolist()}]))
    np.testing.assert_array_equal(part.transform, np.eye(4))


def test_a_node_that_is_scaled_to_nothing_is_invisible(tmp_path: Path) -> None:
    found = parts(tmp_path, tree([{"name": "gone", "mesh": 0, "scale": [0, 0, 0]}, {"name": "there", "mesh": 0}]))
    assert named(found) == ["there"]


def test_a_flattened_node_is_drawn_flat(tmp_path: Path) -> None:
    """A scale of 0 along z puts the mesh into a plane. No transform is left that could not be inverted."""
    file = GltfFile(nodes=[{"mesh": 0, "scale": [2, 2, 0], "translation": [0, 0, 5]}])
    slanted = TRIANGLE.copy()
    slanted[2, 2] = 3
    normals = np.tile(np.array([0, 0, 1], dtype="<f4"), (3, 1))
    (part,) = parts(tmp_path, file.one(file.primitive(POSITION=slanted, NORMAL=normals)))
    assert abs(np.linalg.det(part.transform[:3, :3])) > 0.1
    np.testing.assert_allclose(part.mesh.bounds @ part.transform[:3, :3].T + part.transform[:3, 3], [[0, 0, 5], [2, 2, 5]])
    np.testing.assert_allclose(part.mesh.normals, [[0, 0, 1]] * 3)


def test_two_parents_and_cycles_are_named(tmp_path: Path) -> None:
    with pytest.raises(AssetError, match=r"nodes\[2\] has two parents, nodes\[0\] and nodes\[1\]"):
        parts(tmp_path, tree([{"children": [2]}, {"children": [2]}, {"mesh": 0}]))
    with pytest.raises(AssetError, match=r"form a cycle: node [12] is its own ancestor"):
        parts(tmp_path, tree([{"mesh": 0}, {"children": [2]}, {"children": [1]}]))


def test_a_hidden_node_hides_its_children(tmp_path: Path) -> None:
    hidden = {"extensions": {"KHR_node_visibility": {"visible": False}}}
    nodes = [{"children": [1], **hidden}, {"name": "a", "mesh": 0}, {"name": "b", "mesh": 0}]
    assert named(parts(tmp_path, tree(nodes, extensionsUsed=["KHR_node_visibility"]))) == ["b"]


def test_instances_of_a_node(tmp_path: Path) -> None:
    """EXT_mesh_gpu_instancing: the copies are placed by translation, rotation and scale, then by the node."""
    file = GltfFile(extensionsRequired=["EXT_mesh_gpu_instancing"])
    half = float(np.sqrt(0.5))
    attributes = {
        "TRANSLATION": file.accessor(np.array([[0, 0, 0], [0, 0, 1]], dtype="<f4")),
        "ROTATION": file.accessor(np.array([[0, 0, 0, 1], [0, 0, half, half]], dtype="<f4")),
        "SCALE": file.accessor(np.array([[1, 1, 1], [2, 2, 2]], dtype="<f4")),
    }
    extension = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    file.header["nodes"] = [{"mesh": 0, "translation": [5, 0, 0], "extensions": extension}]
    first, second = parts(tmp_path, file.one(file.primitive(POSITION=TRIANGLE)))
    assert first.mesh is second.mesh
    np.testing.assert_allclose(first.transform @ [1, 0, 0, 1], [6, 0, 0, 1], atol=1e-6)
    np.testing.assert_allclose(second.transform @ [1, 0, 0, 1], [5, 2, 1, 1], atol=1e-6)
    extension["EXT_mesh_gpu_instancing"]["attributes"]["SCALE"] = file.accessor(np.ones((3, 3), dtype="<f4"))
    with pytest.raises(AssetError, match=r"its attributes have \[2, 3\] elements"):
        parts(tmp_path, file)


def test_more_instances_than_a_picture_may_have_are_refused_before_they_are_made(tmp_path: Path) -> None:
    """The accessor needs no bytes, so that a tiny file may ask for millions of copies."""
    file = GltfFile()
    table = {"componentType": 5126, "count": 5_000_000, "type": "VEC3"}
    attributes = {"TRANSLATION": file.table(table)}
    file.header["nodes"] = [{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": attributes}}}]
    with pytest.raises(AssetError, match="draws 5,000,000 copies of a mesh; 100,000 are allowed"):
        parts(tmp_path, file.one(file.primitive(POSITION=TRIANGLE)))


def test_extensions_that_are_needed_or_used(tmp_path: Path) -> None:
    needed = tree([{"mesh": 0}], extensionsRequired=["VENDOR_voxels", "KHR_mesh_quantization"])
    with pytest.raises(AssetError, match="needs the glTF extension VENDOR_voxels, which glshade does not read"):
        parts(tmp_path, needed)
    used = tree([{"mesh": 0}], extensionsUsed=["VENDOR_voxels", "KHR_mesh_quantization", "KHR_xmp_json_ld"])
    with pytest.warns(AssetWarning, match="extensions VENDOR_voxels are not used") as caught:
        parts(tmp_path, used)
    assert len(caught) == 1


def test_animations_are_named_as_left_out(tmp_path: Path) -> None:
    with pytest.warns(AssetWarning, match="a.glb: its animations are not played"):
        parts(tmp_path, tree([{"mesh": 0}], animations=[{"channels": [], "samplers": []}]))


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ({"asset": {"version": "1.0"}, "meshes": {"m": {}}}, r"is glTF 1\.0; only glTF 2 is supported"),
        ({"asset": {}, "meshes": {"m": {}}}, "is glTF 1; only glTF 2 is supported"),
        ({"asset": {"version": "2.1", "minVersion": "2.1"}}, r"needs glTF 2\.1; only glTF 2\.0"),
        ({"meshes": []}, "it has no 'asset'"),
    ],
)
def test_other_versions_are_named(tmp_path: Path, document: dict[str, Any], message: str) -> None:
    (tmp_path / "a.gltf").write_text(json.dumps(document))
    with pytest.raises(AssetError, match=message):
        load(tmp_path / "a.gltf")


def test_many_nodes_are_read_in_a_time_that_grows_with_their_number(tmp_path: Path) -> None:
    """Four times the nodes take about four times as long, side by side and in a chain."""

    def seconds(nodes: list[dict[str, Any]]) -> float:
        path = tree(nodes, scenes=[{"nodes": [0]}]).write(tmp_path / f"{len(nodes)}.glb")
        since = time.process_time()
        load(path)
        return time.process_time() - since

    def chain(count: int) -> list[dict[str, Any]]:
        return [*({"children": [index + 1]} for index in range(count)), {"mesh": 0}]

    def wide(count: int) -> list[dict[str, Any]]:
        return [{"children": list(range(1, count))}, *({"mesh": 0} for _ in range(count - 1))]

    for shape, count in ((chain, 8000), (wide, 1000)):
        seconds(shape(count))
        assert seconds(shape(4 * count + 1)) < 12 * max(seconds(shape(count + 1)), 0.01)
