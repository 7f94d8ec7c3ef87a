"""glTF geometry: accessors, topologies, morph targets and skins give the vertices that the specification describes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import glshade
from glshade.assembly.assembly import assemble
from glshade.errors import AssetError
from glshade.mesh.file import load
from glshade.mesh.mesh import Mesh
from glshade.mesh.model import MeshPart
from tests.support.gltf_file import TRIANGLE, GltfFile

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], dtype="<f4")


def parts(tmp_path: Path, file: GltfFile) -> tuple[MeshPart, ...]:
    return load(file.write(tmp_path / "a.glb")).parts


def only(tmp_path: Path, file: GltfFile) -> Mesh:
    (part,) = parts(tmp_path, file)
    return part.mesh


def placed(part: MeshPart) -> Any:
    """Returns the corners of a part's triangles (T, 3, 3) in file space."""
    corners = (part.mesh.positions.astype(float) + part.mesh.origin)[part.mesh.triangles]
    return corners @ part.transform[:3, :3].T + part.transform[:3, 3]


def corner_set(corners: Any) -> set[tuple[tuple[float, ...], ...]]:
    """Returns the triangles without the order of their corners."""
    return {tuple(sorted(map(tuple, np.round(triangle, 6).tolist()))) for triangle in corners}


def facing(corners: Any) -> Any:
    """Returns the unit normals (T, 3) by the winding."""
    n = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return n / np.linalg.norm(n, axis=1, keepdims=True)


# --- topologies ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("mode", "order", "expected"),
    [
        (None, [0, 1, 2, 2, 1, 3], [(0, 1, 2), (1, 2, 3)]),
        (4, [0, 1, 2, 3], [(0, 1, 2)]),
        (5, [0, 1, 2, 3], [(0, 1, 2), (1, 2, 3)]),
        (5, [0, 1, 2, 2, 1, 1, 3, 2], [(0, 1, 2), (1, 2, 3)]),
        (6, [0, 1, 3, 2], [(0, 1, 3), (0, 2, 3)]),
    ],
)
def test_topologies_of_triangles(tmp_path: Path, mode: int | None, order: list[int], expected: Any) -> None:
    file = GltfFile()
    (part,) = parts(tmp_path, file.one(file.primitive(order, mode, POSITION=SQUARE)))
    assert corner_set(placed(part)) == {tuple(sorted(map(tuple, SQUARE[list(t)].tolist()))) for t in expected}
    if order != [0, 1, 2, 2, 1, 1, 3, 2]:
        np.testing.assert_allclose(facing(placed(part)), [[0, 0, 1]] * len(expected), atol=1e-6)


@pytest.mark.parametrize(
    ("mode", "strokes"),
    [
        (0, [(0, 0), (1, 1), (2, 2)]),
        (1, [(0, 1)]),
        (2, [(0, 1), (1, 2), (2, 0)]),
        (3, [(0, 1), (1, 2)]),
    ],
)
def test_points_and_lines(tmp_path: Path, mode: int, strokes: Any) -> None:
    file = GltfFile()
    mesh = only(tmp_path, file.one(file.primitive(mode=mode, POSITION=TRIANGLE)))
    assert mesh.strokes is not None
    assert len(mesh.triangles) == 0
    found = mesh.positions[mesh.strokes]
    np.testing.assert_array_equal(found, TRIANGLE[np.array(strokes)])


def test_triangles_without_normals_are_flat(tmp_path: Path) -> None:
    """Two faces that share an edge at 30 degrees have each its own normal (glTF 2.0, 3.7.2.1), and tangents do not count."""
    bent = SQUARE.copy()
    bent[3, 2] = 0.4
    file = GltfFile()
    tangents = np.tile(np.array([1, 0, 0, 1], dtype="<f4"), (4, 1))
    mesh = only(tmp_path, file.one(file.primitive([0, 1, 2, 2, 1, 3], POSITION=bent, TANGENT=tangents)))
    assert mesh.normals is not None
    assert mesh.tangents is None
    for triangle in mesh.triangles:
        normals = mesh.normals[triangle]
        np.testing.assert_allclose(normals, [facing(mesh.positions[triangle][None])[0]] * 3, atol=1e-6)
    assert len(np.unique(np.round(mesh.normals, 4), axis=0)) == 2


# --- accessors -------------------------------------------------------------------------------------------------------


@given(data=st.data(), kind=st.sampled_from(["u1", "u2", "f4"]), columns=st.sampled_from([3, 4]))
@settings(max_examples=25, deadline=None)
def test_colours_of_every_type(tmp_path_factory: pytest.TempPathFactory, data: Any, kind: str, columns: int) -> None:
    top = {"u1": 255, "u2": 65535, "f4": 1}[kind]
    values = data.draw(st.lists(st.integers(0, top), min_size=3 * columns, max_size=3 * columns))
    colours = np.array(values, dtype=f"<{kind}").reshape(3, columns)
    file = GltfFile()
    primitive = file.primitive(POSITION=TRIANGLE, COLOR_0=file.accessor(colours, normalized=kind != "f4"))
    mesh = only(tmp_path_factory.mktemp("colours"), file.one(primitive))
    assert mesh.colours is not None
    expected = np.ones((3, 4))
    expected[:, :columns] = colours / top
    order = [np.flatnonzero((mesh.positions == p).all(axis=1))[0] for p in TRIANGLE]
    np.testing.assert_allclose(mesh.colours[order], expected, atol=1e-7)


def test_positions_of_quantized_integers_keep_their_values(tmp_path: Path) -> None:
    """KHR_mesh_quantization: integers that are not normalized are themselves, normalized ones are fractions."""
    for normalized, scale in ((False, 1.0), (True, 1 / 127)):
        file = GltfFile(extensionsRequired=["KHR_mesh_quantization"])
        packed = np.zeros((3, 4), dtype="i1")
        packed[:, :3] = [[-128, 0, 0], [127, 0, 0], [0, 64, 0]]
        view = file.view(packed.tobytes(), byteStride=4)
        table = {"bufferView": view, "componentType": 5120, "count": 3, "type": "VEC3", "normalized": normalized}
        mesh = only(tmp_path, file.one(file.primitive(POSITION=file.table(table))))
        low, high = mesh.bounds
        np.testing.assert_allclose(
            [low, high], [[max(-128 * scale, -1.0 if normalized else -128), 0, 0], [127 * scale, 64 * scale, 0]]
        )


def test_a_stride_and_offsets_lead_through_interleaved_vertices(tmp_path: Path) -> None:
    file = GltfFile()
    normals = np.tile(np.array([0, 0, 1], dtype="<f4"), (3, 1))
    view = file.view(b"\7" * 8 + np.hstack([TRIANGLE, normals]).tobytes(), byteStride=24)
    both = {"bufferView": view, "componentType": 5126, "count": 3, "type": "VEC3"}
    primitive = file.primitive(POSITION=file.table({**both, "byteOffset": 8}), NORMAL=file.table({**both, "byteOffset": 20}))
    mesh = only(tmp_path, file.one(primitive))
    np.testing.assert_array_equal(mesh.positions, TRIANGLE)
    np.testing.assert_array_equal(mesh.normals, normals)


@pytest.mark.parametrize("has_base", [True, False])
def test_sparse_values_replace_those_of_the_base_or_zeros(tmp_path: Path, has_base: bool) -> None:
    file = GltfFile()
    sparse = {
        "count": 2,
        "indices": {"bufferView": file.view(np.array([1, 2], dtype="u1").tobytes()), "componentType": 5121},
        "values": {"bufferView": file.view(np.array([[1, 0, 0], [0, 1, 0]], dtype="<f4").tobytes())},
    }
    table: dict[str, Any] = {"componentType": 5126, "count": 3, "type": "VEC3", "sparse": sparse}
    if has_base:
        table["bufferView"] = file.view(np.array([[0, 0, 0], [9, 9, 9], [9, 9, 9]], dtype="<f4").tobytes())
    (part,) = parts(tmp_path, file.one(file.primitive(POSITION=file.table(table))))
    assert corner_set(placed(part)) == corner_set(TRIANGLE[None].astype(float))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"count": 4}, r"accessors\[0\] needs 48 bytes .* bufferViews\[0\] has 36"),
        ({"byteOffset": 4}, r"accessors\[0\] needs 40 bytes"),
        ({"bufferView": 7}, r"accessors\[0\]\.bufferView is 7, but the file has 1 bufferViews"),
        ({"componentType": 5124}, r"accessors\[0\]\.componentType is 5124"),
        ({"type": "VEC2"}, r"accessors\[0\] is of type VEC2, where VEC3 is needed"),
        ({"count": -1}, r"accessors\[0\]\.count must be a whole number of 0 or more, not -1"),
        ({"count": 10**12, "bufferView": None}, r"accessors\[0\]\.bufferView is None"),
        ({"type": 5}, r"accessors\[0\]\.type must be a text, not 5"),
    ],
)
def test_a_wrong_accessor_is_named_before_anything_is_read(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    file = GltfFile()
    file.one(file.primitive(POSITION=TRIANGLE))
    file.header["accessors"][0] |= change
    with pytest.raises(AssetError, match=message) as error:
        parts(tmp_path, file)
    assert "\n" not in str(error.value)


def test_an_accessor_without_bytes_is_bounded(tmp_path: Path) -> None:
    file = GltfFile()
    table = {"componentType": 5126, "count": 10**12, "type": "VEC3"}
    with pytest.raises(AssetError, match="--max-triangles"):
        parts(tmp_path, file.one(file.primitive(POSITION=file.table(table))))


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (("meshes", 0, "primitives", 0, "attributes"), 3, r"meshes\[0\]\.primitives\[0\]\.attributes must be a table, not 3"),
        (("meshes", 0, "primitives", 0, "mode"), 9, r"meshes\[0\]\.primitives\[0\]\.mode is 9"),
        (("meshes", 0), {}, r"meshes\[0\] has no 'primitives'"),
        (("nodes", 0, "mesh"), 4, r"nodes\[0\]\.mesh is 4, but the file has 1 meshes"),
        (("nodes", 0, "scale"), [1, 2], r"nodes\[0\]\.scale must be a list of 3 numbers"),
        (("nodes", 0, "scale"), [1, 2, 1e999], r"nodes\[0\]\.scale\[2\] must be a finite number"),
        (("nodes", 0, "children"), [0.5], r"nodes\[0\]\.children\[0\] is 0\.5"),
        (("nodes",), {"a": {}}, "nodes must be a list"),
    ],
)
def test_wrong_json_is_named_by_its_place(tmp_path: Path, path: tuple[Any, ...], value: Any, message: str) -> None:
    file = GltfFile()
    file.one(file.primitive(POSITION=TRIANGLE))
    node: Any = file.header
    for key in path[:-1]:
        node = node[key]
    node[path[-1]] = value
    with pytest.raises(AssetError, match=message):
        parts(tmp_path, file)


def test_a_primitive_without_positions_is_not_drawn(tmp_path: Path) -> None:
    """It is no fault (glTF 2.0, 3.7.2.1), but a file that has nothing else holds nothing to draw."""
    file = GltfFile()
    nothing = file.primitive(TEXCOORD_0=np.zeros((3, 2), dtype="<f4"))
    with pytest.raises(AssetError, match="holds nothing to draw"):
        parts(tmp_path, file.one(nothing))
    file.header["meshes"][0]["primitives"].append(file.primitive(POSITION=TRIANGLE))
    assert len(parts(tmp_path, file)) == 1


# --- tangents --------------------------------------------------------------------------------------------------------


def test_tangents_of_the_file_are_kept_with_their_handedness(tmp_path: Path) -> None:
    file = GltfFile()
    normals = np.tile(np.array([0, 0, 1], dtype="<f4"), (3, 1))
    tangents = np.array([[0, 2, 0, -1], [0, 1, 1, -1], [1, 0, 0, 1]], dtype="<f4")
    mesh = only(tmp_path, file.one(file.primitive(POSITION=TRIANGLE, NORMAL=normals, TANGENT=tangents)))
    np.testing.assert_allclose(mesh.tangents, [[0, 1, 0, -1], [0, 1, 0, -1], [1, 0, 0, 1]], atol=1e-6)


def test_both_renderers_use_the_tangents_of_the_file(tmp_path: Path) -> None:
    """An anisotropic highlight follows them. Tangents that are turned by 90 degrees give another picture."""
    normals = np.tile(np.array([0, 0, 1], dtype="<f4"), (4, 1))
    pictures = []
    for name, tangent in (("a", (1, 0, 0, 1)), ("b", (0, 1, 0, -1))):
        file = GltfFile()
        tangents = np.tile(np.array(tangent, dtype="<f4"), (4, 1))
        file.one(file.primitive([0, 1, 2, 2, 1, 3], POSITION=SQUARE, NORMAL=normals, TANGENT=tangents))
        file.write(tmp_path / f"{name}.glb")
        material = {"brdf": "ggx", "metallic": 1.0, "roughness": 0.4, "anisotropy": 0.9}
        film = {"size": [24, 18], "samples": 1}
        (tmp_path / f"{name}.json").write_text(
            json.dumps({"objects": [{"mesh": f"{name}.glb", "material": material}], "film": film})
        )
        scene = glshade.load(tmp_path / f"{name}.json")
        np.testing.assert_array_equal(assemble(scene).instances[0].mesh.tangents, tangents)
        assert glshade.verify(scene).exit_code == 0
        pictures.append(np.asarray(glshade.reference.render(scene).pixels))
    assert np.abs(pictures[0] - pictures[1]).max() > 0.05


# --- morph targets ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("of_mesh", "of_node", "weight"), [([0.5], None, 0.5), ([0.5], [2.0], 2.0), (None, None, 0.0)])
def test_morph_targets_by_the_weights_of_node_or_mesh(
    tmp_path: Path, of_mesh: list[float] | None, of_node: list[float] | None, weight: float
) -> None:
    file = GltfFile()
    normals = np.tile(np.array([0, 0, 1], dtype="<f4"), (3, 1))
    primitive = file.primitive(POSITION=TRIANGLE, NORMAL=normals)
    moved = np.tile(np.array([0, 0, 4], dtype="<f4"), (3, 1))
    tilted = np.tile(np.array([1, 0, 0], dtype="<f4"), (3, 1))
    primitive["targets"] = [{"POSITION": file.accessor(moved), "NORMAL": file.accessor(tilted)}]
    file.one(primitive, **({"weights": of_mesh} if of_mesh else {}))
    if of_node:
        file.header["nodes"][0]["weights"] = of_node
    (part,) = parts(tmp_path, file)
    np.testing.assert_allclose(placed(part)[0, :, 2], 4 * weight, atol=1e-6)
    normal = np.array([weight, 0, 1]) / np.hypot(weight, 1)
    assert part.mesh.normals is not None
    np.testing.assert_allclose(part.mesh.normals, [normal] * 3, atol=1e-6)


def test_nodes_that_morph_one_mesh_differently_get_meshes_of_their_own(tmp_path: Path) -> None:
    file = GltfFile(nodes=[{"mesh": 0}, {"mesh": 0, "weights": [1.0]}, {"mesh": 0, "weights": [1.0]}])
    primitive = file.primitive(POSITION=TRIANGLE)
    primitive["targets"] = [{"POSITION": file.accessor(TRIANGLE)}]
    plain, first, second = parts(tmp_path, file.one(primitive))
    assert first.mesh is second.mesh
    assert plain.mesh is not first.mesh
    np.testing.assert_allclose(first.mesh.bounds, 2 * plain.mesh.bounds)


# --- skins -----------------------------------------------------------------------------------------------------------


def skinned(weights: Any, joints: Any, nodes: list[dict[str, Any]], binds: Any = None, **attributes: Any) -> GltfFile:
    """Returns a file with a skinned triangle: nodes 0 and 1 are joints, and the last node shows it."""
    file = GltfFile(nodes=nodes)
    given = {"JOINTS_0": np.array(joints, dtype="u1"), "WEIGHTS_0": np.array(weights, dtype="<f4")}
    primitive = file.primitive(POSITION=TRIANGLE, **given, **attributes)
    skin: dict[str, Any] = {"joints": [0, 1]}
    if binds is not None:
        skin["inverseBindMatrices"] = file.accessor(np.array(binds, dtype="<f4").transpose(0, 2, 1).reshape(2, 16))
    file.header["skins"] = [skin]
    return file.one(primitive)


def moved(x: float, y: float, z: float) -> Any:
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def test_a_skin_moves_its_vertices_and_its_node_does_not(tmp_path: Path) -> None:
    """Vertex 0 follows joint 0, vertex 1 joint 1, and vertex 2 both (glTF 2.0, 3.7.3)."""
    nodes = [
        {"translation": [0, 0, 1], "children": [1]},
        {"translation": [0, 0, 2]},
        {"mesh": 0, "skin": 0, "scale": [9, 9, 9]},
    ]
    binds = [moved(0, 0, 0), moved(5, 0, 0)]
    joints = [[0, 1, 0, 0], [1, 0, 0, 0], [0, 1, 0, 0]]
    # The second vertex's weights add up to 2, and are made to add up to 1.
    file = skinned([[1, 0, 0, 0], [2, 0, 0, 0], [0.5, 0.5, 0, 0]], joints, nodes, binds)
    (part,) = parts(tmp_path, file)
    expected = np.array([[0, 0, 1], [6, 0, 3], [2.5, 1, 2]], dtype=float)
    assert corner_set(placed(part)) == corner_set(expected[None])


def test_a_skin_turns_normals_and_tangents(tmp_path: Path) -> None:
    half = float(np.sqrt(0.5))
    nodes = [{"rotation": [half, 0, 0, half], "scale": [1, 1, 4]}, {}, {"mesh": 0, "skin": 0}]
    normals = np.tile(np.array([0, half, half], dtype="<f4"), (3, 1))
    tangents = np.tile(np.array([1, 0, 0, -1], dtype="<f4"), (3, 1))
    file = skinned([[1, 0, 0, 0]] * 3, [[0, 0, 0, 0]] * 3, nodes, NORMAL=normals, TANGENT=tangents)
    mesh = only(tmp_path, file)
    # The inverse transpose of the scale turns (0, 1, 1) into (0, 1, 1/4), and the rotation about x takes y to z and z to -y.
    expected = np.array([0, -0.25, 1]) / np.hypot(0.25, 1)
    assert mesh.normals is not None
    np.testing.assert_allclose(mesh.normals, [expected] * 3, atol=1e-6)
    np.testing.assert_allclose(mesh.tangents, [[1, 0, 0, -1]] * 3, atol=1e-6)


def test_a_second_set_of_joints_counts(tmp_path: Path) -> None:
    nodes = [{}, {"translation": [0, 0, 2]}, {"mesh": 0, "skin": 0}]
    half = np.tile(np.array([0.5, 0, 0, 0], dtype="<f4"), (3, 1))
    second = {"JOINTS_1": np.tile(np.array([1, 0, 0, 0], dtype="<u2"), (3, 1)), "WEIGHTS_1": half}
    (part,) = parts(tmp_path, skinned(half, [[0, 0, 0, 0]] * 3, nodes, **second))
    np.testing.assert_allclose(placed(part)[0, :, 2], 1.0)


def test_a_vertex_whose_joint_does_not_exist_is_named(tmp_path: Path) -> None:
    file = skinned([[1, 0, 0, 0]] * 3, [[0, 0, 0, 0], [7, 0, 0, 0], [0, 0, 0, 0]], [{}, {}, {"mesh": 0, "skin": 0}])
    with pytest.raises(AssetError, match=r"meshes\[0\]\.primitives\[0\]: vertex 1 names joint 7, but its skin has 2 joints"):
        parts(tmp_path, file)


def test_a_mirrored_node_flips_the_winding_of_its_skinned_mesh(tmp_path: Path) -> None:
    """The sign of the node's scale gives the winding even where its transform does not move the mesh (glTF 2.0, 3.7.4)."""
    for scale, sign in ((1, 1), (-1, -1)):
        nodes = [{}, {}, {"mesh": 0, "skin": 0, "scale": [scale, 1, 1]}]
        (part,) = parts(tmp_path, skinned([[1, 0, 0, 0]] * 3, [[0, 0, 0, 0]] * 3, nodes))
        np.testing.assert_allclose(facing(placed(part)), [[0, 0, sign]], atol=1e-6)
