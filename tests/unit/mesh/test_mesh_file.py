"""Mesh files: what real ones hold, what broken ones say, and the cache that spares the second run the parser."""

from __future__ import annotations

import base64
import json
import os
import shutil
import struct
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glshade import BRDFS, Image
from glshade.errors import AssetError
from glshade.mesh import file as mesh_file
from glshade.mesh import formats
from glshade.mesh.file import AssetWarning, load
from glshade.mesh.mesh import Mesh
from glshade.mesh.model import Model
from glshade.mesh.reading.polygon import triangulated

ROOT = Path(__file__).parents[3]
MESHES = ROOT.parent / "shared" / "data" / "meshes"

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
PNG = base64.b64decode("iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg==")


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    forget()
    return tmp_path / "cache"


def forget() -> None:
    """Empties the memory of the loader, so that it behaves as in a new process. The cache folder keeps its entries."""
    mesh_file._memory.clear()


def flip_a_bit(file: Path, place: int) -> None:
    """Changes one bit of the byte at a place of a file."""
    data = bytearray(file.read_bytes())
    data[place] ^= 1
    file.write_bytes(data)


def written(tmp_path: Path, name: str, content: str | bytes) -> Path:
    path = tmp_path / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def only(model: Model) -> Mesh:
    assert len(model.parts) == 1
    return model.parts[0].mesh


def area(mesh: Mesh) -> float:
    p = mesh.positions.astype(float)[mesh.triangles]
    return float(np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1).sum() / 2)


def gltf(attributes: dict[str, Any], indices: Any = (0, 1, 2), **header: Any) -> tuple[dict[str, Any], bytes]:
    """Returns a glTF header with one mesh, and its buffer."""
    sizes = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
    kinds = {"f4": 5126, "u1": 5121, "u2": 5123, "u4": 5125}
    blob, views, accessors = b"", [], []
    arrays = {**attributes, "": np.array(indices, dtype="<u2")}
    for array in (np.asarray(a) for a in arrays.values()):
        blob += b"\0" * (-len(blob) % 4)
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": array.nbytes})
        kind = kinds[array.dtype.str[1:]]
        accessor: dict[str, Any] = {"bufferView": len(views) - 1, "componentType": kind, "count": len(array)}
        accessor["type"] = sizes[1 if array.ndim == 1 else array.shape[1]]
        if kind in (5121, 5123) and array.ndim > 1:
            accessor["normalized"] = True
        accessors.append(accessor)
        blob += array.tobytes()
    primitive = {"attributes": {name: i for i, name in enumerate(attributes)}, "indices": len(attributes)}
    if "materials" in header:
        primitive["material"] = 0
    tree = {
        "asset": {"version": "2.0"},
        "meshes": [{"name": "thing", "primitives": [primitive]}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(blob)}],
    }
    return tree | header, blob


def glb(header: dict[str, Any], blob: bytes) -> bytes:
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    blob += b"\0" * (-len(blob) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(blob), b"BIN\0") + blob
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


POSITIONS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype="<f4")
UVS = np.array([[0, 0], [1, 0], [0, 0.25]], dtype="<f4")


# --- OBJ -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("faces", "triangles"),
    [
        ("f 1 2 3\n", 1),
        ("f -3 -2 -1\n", 1),
        ("f 1 2 3 4\n", 2),
        ("f 1 2 3\nf 1 3 4\n", 2),
        ("f 1 2 3 4\nf 1 2 3\n", 3),
        ("f  1\t2  3 # comment\n", 1),
        ("f 1 2 \\\n3\n", 1),
        ("g a b\nf 1// 2// 3//\n", 1),
    ],
)
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_obj_faces(tmp_path: Path, faces: str, triangles: int, newline: str) -> None:
    text = "# usemtl in a comment\n" + TRIANGLE + "v 0 -1 0\n" + faces
    mesh = only(load(written(tmp_path, "a.obj", text.replace("\n", newline))))
    assert len(mesh.triangles) == triangles
    assert mesh.normals is None
    assert mesh.uvs is None
    assert mesh.colours is None
    if "-3" not in faces and triangles == 1:
        np.testing.assert_array_equal(mesh.positions[mesh.triangles[0]], POSITIONS)


def test_obj_negative_indices_count_from_where_they_stand(tmp_path: Path) -> None:
    other = "v 5 0 0\nv 6 0 0\nv 5 1 0\n"
    mesh = only(load(written(tmp_path, "a.obj", TRIANGLE + "f -3 -2 -1\n" + other + "f -3 -2 -1\n")))
    np.testing.assert_array_equal(mesh.positions[mesh.triangles[0]], POSITIONS)
    np.testing.assert_array_equal(mesh.positions[mesh.triangles[1]], POSITIONS + np.array([5, 0, 0]))


def test_obj_concave_polygon(tmp_path: Path) -> None:
    dart = "v 0 0 0\nv 4 1 0\nv 0 2 0\nv 1 1 0\n"
    mesh = only(load(written(tmp_path, "a.obj", dart + "f 1 2 3 4\n")))
    assert area(mesh) == pytest.approx(3)


def test_triangulation_of_a_concave_outline_covers_it_once() -> None:
    comb = [(0, 0), (7, 0), (7, 3), (6, 1), (5, 3), (4, 1), (3, 3), (2, 1), (1, 3), (0, 1)]
    p = np.array([[x, y, 0.5 * x] for x, y in comb], dtype=float)
    flat = np.array(comb, dtype=float)
    for outline in (p, p[::-1]):
        triangles = triangulated(outline)
        assert len(triangles) == len(comb) - 2
        a, b, c = outline[np.array(triangles)][:, :, :2].transpose(1, 0, 2)
        signed = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
        x, y = flat.T
        whole = abs(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
        assert np.abs(signed).sum() == pytest.approx(whole)
        assert (np.sign(signed) == np.sign(signed[0])).all()


def test_obj_splits_a_vertex_with_several_uvs_or_normals(tmp_path: Path) -> None:
    text = TRIANGLE + "v 1 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvt 1 1\nvn 0 0 2\nvn 0 1 0\n"
    path = written(tmp_path, "a.obj", text + "f 1/1/1 2/2/1 3/3/1\nf 2/4/2 4/4/2 3/3/2\n")
    mesh = only(load(path))
    assert len(mesh.positions) == 6
    assert mesh.normals is not None
    assert mesh.uvs is not None
    np.testing.assert_array_equal(mesh.normals[mesh.triangles], [[[0, 0, 1]] * 3, [[0, 1, 0]] * 3])
    np.testing.assert_array_equal(mesh.uvs[mesh.triangles[1]], [[1, 1], [1, 1], [0, 1]])
    np.testing.assert_array_equal(mesh.positions[mesh.triangles[1]], [[1, 0, 0], [1, 1, 0], [0, 1, 0]])


def test_obj_corners_of_different_forms(tmp_path: Path) -> None:
    text = TRIANGLE + "vt 0.5 0.5\nvn 0 0 1\nf 1 2 3\nf 1/1 2/1 3/1\nf 1//1 2//1 3//1\nf 1/1/1 2/1/1 3/1/1\n"
    parts = load(written(tmp_path, "a.obj", text)).parts
    found = {(part.mesh.uvs is not None, part.mesh.normals is not None) for part in parts}
    assert len(parts) == 4
    assert len(found) == 4
    for part in parts:
        np.testing.assert_array_equal(part.mesh.positions[part.mesh.triangles[0]], POSITIONS)
        if part.mesh.uvs is not None:
            np.testing.assert_array_equal(part.mesh.uvs, 0.5)
        if part.mesh.normals is not None:
            np.testing.assert_array_equal(part.mesh.normals, [[0, 0, 1]] * 3)


def test_obj_colours_are_decoded_and_never_invented(tmp_path: Path) -> None:
    text = "v 0 0 0 1 0 0.5\nv 1 0 0 1 0 0.5\nv 0 1 0 1 0 0.5\nf 1 2 3\n"
    mesh = only(load(written(tmp_path, "a.obj", text)))
    assert mesh.colours is not None
    np.testing.assert_allclose(mesh.colours, [[1, 0, 0.21404114, 1]] * 3, atol=1e-6)


def test_obj_materials_keep_their_exact_floats(tmp_path: Path) -> None:
    written(tmp_path, "fuze uv.png", PNG)
    written(
        tmp_path,
        "a.obj.mtl",
        "newmtl shiny one\nKd 0.123456 0.2 0.3\nKs 0.7 0.7 0.7\nNs 96.078431\nKa 0.1 0.1 0.1\nillum 2\nTr 1.0\n"
        "newmtl dull\nKd 0 0 0\nKs 0 0 0\nNs 10\nmap_Kd -clamp on -s 1 1 1 fuze uv.png\nd 0.25\n"
        "newmtl flat\nKd 0.5 0.5 0.5\nKs 1 1 1\nillum 1\nnorm FUZE UV.PNG\nTr 0.25\n",
    )
    faces = "f 1 2 3\n"
    text = f"mtllib a.obj.mtl\r\n{TRIANGLE}usemtl shiny one\n{faces}usemtl dull\n{faces}usemtl flat\n{faces}"
    parts = {part.name: part for part in load(written(tmp_path, "a.obj", text)).parts}
    picture = str(tmp_path / "fuze uv.png")
    assert parts["shiny one"].material == {
        "brdf": "phong",
        "kd": [0.123456, 0.2, 0.3],
        "ks": [0.7, 0.7, 0.7],
        "exponent": 96.078431,
        "ka": [0.1, 0.1, 0.1],
    }
    assert parts["dull"].material == {
        "brdf": "lambert",
        "kd": {"texture": picture, "factor": [1.0, 1.0, 1.0], "wrap": ["clamp", "clamp"]},
        "alpha": 0.25,
        "alpha_mode": "blend",
    }
    assert parts["flat"].material == {
        "brdf": "lambert",
        "kd": [0.5, 0.5, 0.5],
        "normal_map": {"texture": picture},
        "alpha": 0.75,
        "alpha_mode": "blend",
    }


@pytest.mark.parametrize("key", ["bump", "map_bump", "map_Bump"])
def test_obj_bump_maps(tmp_path: Path, key: str) -> None:
    """Heights, unless the picture is blue, as normals are; `norm` always has normals."""
    text = f"mtllib a.mtl\n{TRIANGLE}usemtl a\nf 1 2 3\n"

    def material(colour: list[int], statement: str) -> dict[str, Any]:
        Image(np.full((2, 2, 3), colour, dtype=np.uint8)).save(tmp_path / "b.png")
        written(tmp_path, "a.mtl", f"newmtl a\nKd 1 1 1\n{statement} b.png\n")
        forget()
        found = load(written(tmp_path, "a.obj", text)).parts[0].material
        assert found is not None
        BRDFS["lambert"].model_validate(found)
        return found

    path = str(tmp_path / "b.png")
    heights, up = [90, 90, 90], [128, 128, 255]
    assert material(heights, key)["bump_map"] == {"texture": path, "height": 0.05}
    twice = {"texture": path, "height": 0.1, "wrap": ["clamp", "clamp"]}
    assert material(heights, f"{key} -clamp on -bm 2.0")["bump_map"] == twice
    assert material(up, f"{key} -bm 0.5")["normal_map"] == {"texture": path, "scale": 0.5}
    assert material(heights, "norm")["normal_map"] == {"texture": path}
    with pytest.warns(AssetWarning, match="-bm much' is not a number"):
        assert material(heights, f"{key} -bm much")["bump_map"]["height"] == 0.05


def test_obj_objects_are_parts(tmp_path: Path) -> None:
    text = TRIANGLE + "o left\nf 1 2 3\no right\ng x\nf 3 2 1\n"
    assert [part.name for part in load(written(tmp_path, "a.obj", text)).parts] == ["left", "right"]


def test_missing_material_file_and_texture_are_no_errors(tmp_path: Path) -> None:
    path = written(tmp_path, "a.obj", "mtllib gone.mtl\n" + TRIANGLE + "usemtl a\nf 1 2 3\n")
    with pytest.warns(AssetWarning, match=r"a\.obj: material file 'gone\.mtl' not found"):
        assert load(path).parts[0].material is None
    written(tmp_path, "gone.mtl", "newmtl a\nKd 1 0 0\nmap_Kd lost.png\n")
    with pytest.warns(AssetWarning, match=r"texture 'lost\.png' not found"):
        assert load(path).parts[0].material == {"brdf": "lambert", "kd": [1.0, 0.0, 0.0]}
    written(tmp_path, "lost.png", PNG)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        material = load(path).parts[0].material
    assert material is not None
    assert material["kd"]["texture"] == str(tmp_path / "lost.png")


def test_obj_references_to_absent_uvs_are_dropped(tmp_path: Path) -> None:
    path = written(tmp_path, "a.obj", TRIANGLE + "vn 0 0 1\nf 1/1/1 2/2/1 3/3/1\n")
    with pytest.warns(AssetWarning, match="'vt' index out of range"):
        mesh = only(load(path))
    assert mesh.uvs is None
    assert mesh.normals is not None


# --- PLY, STL, OFF ---------------------------------------------------------------------------------------------------

PLY = """ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
element face {count}
property list uchar int vertex_indices
end_header
0 0 0 255 0 128
1 0 0 255 0 128
1 1 0 255 0 128
0 1 0 255 0 128
{faces}
"""


def test_ply_ascii_quads_with_colours(tmp_path: Path) -> None:
    mesh = only(load(written(tmp_path, "a.ply", PLY.format(count=1, faces="4 0 1 2 3"))))
    assert area(mesh) == 1
    assert mesh.normals is None
    assert mesh.colours is not None
    np.testing.assert_allclose(mesh.colours, [[1, 0, 0.21586050, 1]] * 4, atol=1e-6)


def test_ply_binary_with_normals_and_uvs(tmp_path: Path) -> None:
    header = "ply\nformat binary_little_endian 1.0\nelement vertex 3\n"
    header += "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz", "s", "t"))
    header += "element face 1\nproperty list uchar int vertex_index\nend_header\n"
    rows = np.hstack([POSITIONS, [[0, 0.6, 0.8]] * 3, UVS]).astype("<f4")
    data = header.encode() + rows.tobytes() + struct.pack("<B3i", 3, 0, 1, 2)
    mesh = only(load(written(tmp_path, "a.ply", data)))
    assert mesh.normals is not None
    assert mesh.uvs is not None
    assert mesh.colours is None
    np.testing.assert_allclose(mesh.normals, [[0, 0.6, 0.8]] * 3, atol=1e-7)
    np.testing.assert_array_equal(mesh.uvs, UVS)


def test_ply_uvs_of_faces(tmp_path: Path) -> None:
    text = """ply\nformat ascii 1.0\ncomment TextureFile a b.png\nelement vertex 4\nproperty float x\nproperty float y
property float z\nelement face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord
end_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 6 0 0 1 0 1 1\n3 0 2 3 6 0.5 0.5 1 1 0 1\n"""
    written(tmp_path, "a b.png", PNG)
    part = load(written(tmp_path, "a.ply", text)).parts[0]
    assert part.mesh.uvs is not None
    np.testing.assert_array_equal(part.mesh.uvs[part.mesh.triangles][:, 0], [[0, 0], [0.5, 0.5]])
    assert part.material is not None
    assert part.material["kd"]["texture"] == str(tmp_path / "a b.png")


def test_stl_binary_and_ascii(tmp_path: Path) -> None:
    triangle = np.zeros(1, dtype=[("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")])
    triangle["v"] = POSITIONS
    binary = b"solid, says the header".ljust(80) + struct.pack("<I", 1) + triangle.tobytes()
    ascii_ = "solid a\nfacet normal 0 0 1\nouter loop\n"
    ascii_ += "".join(f"vertex {x} {y} {z}\n" for x, y, z in POSITIONS) + "endloop\nendfacet\nendsolid a\n"
    for name, data in (("b.stl", binary), ("a.STL", ascii_)):
        mesh = only(load(written(tmp_path, name, data)))
        np.testing.assert_array_equal(mesh.positions[mesh.triangles[0]], POSITIONS)
        assert mesh.normals is None
        assert mesh.colours is None


def test_off(tmp_path: Path) -> None:
    mesh = only(load(written(tmp_path, "a.off", "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n")))
    assert area(mesh) == 1


# --- glTF ------------------------------------------------------------------------------------------------------------


def test_glb_attributes(tmp_path: Path) -> None:
    normals = np.tile(np.array([0, 0, 1], dtype="<f4"), (3, 1))
    colours = np.array([[255, 0, 51], [0, 255, 0], [0, 0, 255]], dtype="u1")
    colours = np.hstack([colours, np.full((3, 1), 102, dtype="u1")])
    model = load(
        written(
            tmp_path,
            "a.glb",
            glb(*gltf({"POSITION": POSITIONS, "NORMAL": normals, "TEXCOORD_0": UVS, "COLOR_0": colours})),
        )
    )
    mesh = only(model)
    assert mesh.uvs is not None
    assert mesh.colours is not None
    assert mesh.normals is not None
    np.testing.assert_array_equal(mesh.uvs[:, 1], [1, 1, 0.75])
    np.testing.assert_allclose(mesh.colours[0], [1, 0, 0.2, 0.4], atol=1e-7)  # linear already
    assert model.parts[0].name == "thing"


def test_gltf_transforms_are_multiplied_and_instances_share_their_mesh(tmp_path: Path) -> None:
    half = np.sqrt(0.5)
    nodes = [
        {"name": "root", "translation": [1, 2, 3], "children": [1, 2]},
        {"name": "turned", "rotation": [0, 0, half, half], "scale": [2, 2, 2], "mesh": 0},
        {"camera": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1], "children": [3]},
        {"name": "behind the camera", "mesh": 0},
    ]
    camera = {"type": "perspective", "perspective": {"yfov": 1.0, "aspectRatio": 1.0, "znear": 0.1}}
    header, blob = gltf({"POSITION": POSITIONS}, nodes=nodes, scenes=[{"nodes": [0]}], scene=0, cameras=[camera])
    turned, behind = load(written(tmp_path, "a.glb", glb(header, blob))).parts
    np.testing.assert_allclose(turned.transform @ [1, 0, 0, 1], [1, 4, 3, 1], atol=1e-12)
    np.testing.assert_allclose(behind.transform @ [0, 0, 0, 1], [6, 2, 3, 1])
    assert turned.mesh is behind.mesh
    forget()
    again = load(tmp_path / "a.glb").parts
    assert again[0].mesh is again[1].mesh


def test_gltf_material_with_an_embedded_picture(tmp_path: Path) -> None:
    material = {
        "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 1, 0.75], "baseColorTexture": {"index": 0}},
        "normalTexture": {"index": 1, "scale": 0.5},
        "alphaMode": "MASK",
        "alphaCutoff": 0.3,
        "doubleSided": True,
    }
    header, blob = gltf({"POSITION": POSITIONS, "TEXCOORD_0": UVS}, materials=[material])
    blob += b"\0" * (-len(blob) % 4)
    header["bufferViews"].append({"buffer": 0, "byteOffset": len(blob), "byteLength": len(PNG)})
    header["buffers"][0]["byteLength"] = len(blob) + len(PNG)
    data = "data:image/png;base64," + base64.b64encode(PNG).decode()
    header["images"] = [{"bufferView": len(header["bufferViews"]) - 1, "mimeType": "image/png"}, {"uri": data}]
    header["samplers"] = [{"wrapS": 33071, "wrapT": 33648}]
    header["textures"] = [{"source": 0, "sampler": 0}, {"source": 1}]
    path = written(tmp_path, "a.glb", glb(header, blob + PNG))
    for _ in range(2):
        found = load(path).parts[0].material
        assert found is not None
        for texture in (found["kd"].pop("texture"), found["normal_map"].pop("texture")):
            assert Path(texture).read_bytes() == PNG
            assert texture.endswith(".png")
        assert found == {
            "brdf": "ggx",
            "kd": {"factor": [0.5, 0.25, 1.0], "wrap": ["clamp", "mirror"]},
            "metallic": 1.0,
            "roughness": 1.0,
            "normal_map": {"scale": 0.5, "wrap": ["repeat", "repeat"]},
            "alpha_mode": "mask",
            "alpha": 0.75,
            "alpha_cutoff": 0.3,
            "sides": "both",
        }
        forget()


def test_gltf_with_files_beside_it(tmp_path: Path) -> None:
    material = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "alphaMode": "BLEND"}
    header, blob = gltf({"POSITION": POSITIONS, "TEXCOORD_0": UVS}, materials=[material])
    header["buffers"][0]["uri"] = "my%20data.bin"
    header["images"], header["textures"] = [{"uri": "a%20b.png"}], [{"source": 0}]
    path = written(tmp_path, "a.gltf", json.dumps(header))
    with pytest.raises(AssetError, match=r"buffer 'my data\.bin' is missing"):
        load(path)
    written(tmp_path, "my data.bin", blob)
    written(tmp_path, "a b.png", PNG)
    part = load(path).parts[0]
    assert part.material is not None
    assert part.material["kd"]["texture"] == str(tmp_path / "a b.png")
    assert part.material["alpha_mode"] == "blend"
    assert part.material["alpha"] == 1
    moved = POSITIONS * 2
    written(tmp_path, "my data.bin", moved.tobytes() + blob[moved.nbytes :])
    np.testing.assert_array_equal(only(load(path)).positions, moved)


# --- broken files ----------------------------------------------------------------------------------------------------

CYCLE = {"nodes": [{"children": [1]}, {"children": [0], "mesh": 0}]}
GOOD_GLB = glb(*gltf({"POSITION": POSITIONS}))


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.obj", "", "is empty"),
        ("a.obj", "\n \n", "is empty"),
        ("a.obj", b"\x00\xff\xfe garbage \x80" * 50, "holds no vertices"),
        ("a.obj", "f 1 2 3\n", "out of range|no vertices"),
        ("a.obj", TRIANGLE + "f 1 2 4\n", "line 4: 'v' index out of range"),
        ("a.obj", TRIANGLE + "f 0 1 2\n", "line 4: 'v' index out of range"),
        ("a.obj", TRIANGLE + "f 1 2 -4\n", "line 4: 'v' index out of range"),
        ("a.obj", TRIANGLE + "f 1 2\n", "line 4: a face needs three corners"),
        ("a.obj", TRIANGLE + "f 1 2 x\n", "line 4"),
        ("a.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "none of its 1 triangles .* not finite"),
        ("a.obj", "v 1 0 0\nv inf 0 0\nv 0 1 0\nf 1 2 3\n", "none of its 1 triangles .* not finite"),
        ("a.obj", "v 1 0 zero\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "line 1: 'zero' is not a number"),
        ("a.ply", "", "is empty"),
        ("a.ply", "not a ply", "not a readable PLY file"),
        ("a.ply", "ply\nformat ascii 1.0\nelement vertex 3\n", "not a readable PLY file"),
        ("a.ply", PLY.format(count=1, faces="3 0 1 9"), "index 9 is out of range"),
        ("a.ply", PLY.format(count=1, faces="3 0 1 2").replace("1 1 0", "1 nan 0"), "not finite"),
        ("a.stl", "garbage", "not a readable STL file|holds no triangles"),
        ("a.off", "garbage", "not a readable OFF file"),
        ("a.glb", b"garbage", "is not a GLB file"),
        ("a.glb", GOOD_GLB[:10], "is truncated"),
        ("a.glb", GOOD_GLB[:-20], "is truncated"),
        ("a.glb", glb({"asset": {"version": "2.0"}}, b""), "holds nothing to draw"),
        ("a.glb", glb(*gltf({"POSITION": POSITIONS}, (0, 1, 3))), "index 3 is out of range"),
        ("a.glb", glb(*gltf({"POSITION": POSITIONS * np.float32(np.nan)})), "none of its 1 triangles .* not finite"),
        ("a.glb", glb(*gltf({"POSITION": POSITIONS}, **CYCLE)), "form a cycle"),
        ("a.glb", glb(*gltf({"POSITION": POSITIONS}, **CYCLE, scenes=[{"nodes": [0]}])), "form a cycle"),
        ("a.glb", glb(*gltf({"POSITION": POSITIONS}, extensionsRequired=["VENDOR_mesh"])), "the glTF extension VENDOR_mesh"),
        ("a.gltf", "{", "its JSON cannot be read"),
        ("a.gltf", '{"asset": {"version": "1.0"}}', "only glTF 2"),
        ("a.xyz", "1 2 3", r"supported are \.3mf, \.dae, \.glb, \.gltf, \.obj, \.off, \.ply, \.stl"),
    ],
)
def test_a_broken_file_says_what_is_wrong_in_one_line(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], name: str, content: str | bytes, message: str
) -> None:
    path = written(tmp_path, name, content)
    with pytest.raises(AssetError, match=message) as caught:
        load(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_missing_files_and_folders(tmp_path: Path) -> None:
    with pytest.raises(AssetError, match="no such file"):
        load(tmp_path / "gone.obj")
    (tmp_path / "folder.obj").mkdir()
    with pytest.raises(AssetError, match="is a folder"):
        load(tmp_path / "folder.obj")


@pytest.mark.parametrize("keep", range(0, 100, 7))
def test_a_truncated_glb_never_escapes_as_another_error(tmp_path: Path, keep: int) -> None:
    data = GOOD_GLB[: len(GOOD_GLB) * keep // 100]
    with pytest.raises(AssetError):
        load(written(tmp_path, "a.glb", data))


# --- memory and cache ------------------------------------------------------------------------------------------------


def no_parser(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: Any) -> None:
        raise AssertionError("the file was parsed again")

    monkeypatch.setattr(formats, "read", fail)


def test_the_second_load_is_from_memory_and_a_changed_file_is_not(tmp_path: Path) -> None:
    path = written(tmp_path, "a.obj", TRIANGLE + "f 1 2 3\n")
    first = load(path)
    assert load(path) is first
    written(tmp_path, "a.obj", TRIANGLE + "f 1 2 3\nf 1 3 2\n")
    assert len(only(load(path)).triangles) == 2


def test_a_new_process_reads_the_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written(tmp_path, "a.mtl", "newmtl a\nKd 1 0 0\nmap_Kd lost.png\n")
    path = written(tmp_path, "a.obj", "mtllib a.mtl\n" + TRIANGLE + "vn 0 0 1\nusemtl a\nf 1//1 2//1 3//1\n")
    with pytest.warns(AssetWarning):
        first = load(path)
    forget()
    no_parser(monkeypatch)
    with pytest.warns(AssetWarning, match=r"lost\.png"):
        second = load(path)
    assert second is not first
    assert second.parts[0].mesh.digest == first.parts[0].mesh.digest
    assert second.parts[0].material == first.parts[0].material


def test_the_cache_needs_no_reader(tmp_path: Path) -> None:
    path = written(tmp_path, "a.obj", TRIANGLE + "f 1 2 3\n")
    load(path)
    code = f"import sys; from glshade.mesh import file; file.load({str(path)!r}); print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, env=os.environ, capture_output=True, text=True, check=True)
    loaded = set(run.stdout.split())
    assert "glshade.mesh.file" in loaded
    assert not loaded & {"trimesh", "glshade.mesh.formats.obj", "glshade.mesh.reading.parser", "logging", "tempfile"}


def test_a_changed_material_file_ends_the_entry(tmp_path: Path) -> None:
    written(tmp_path, "a.mtl", "newmtl a\nKd 1 0 0\n")
    path = written(tmp_path, "a.obj", "mtllib a.mtl\n" + TRIANGLE + "usemtl a\nf 1 2 3\n")
    load(path)
    written(tmp_path, "a.mtl", "newmtl a\nKd 0 1 0 \n")
    for _ in range(2):
        assert load(path).parts[0].material == {"brdf": "lambert", "kd": [0.0, 1.0, 0.0]}
        forget()


def test_equal_files_in_two_folders_keep_their_own_textures(tmp_path: Path) -> None:
    for folder in ("one", "two"):
        written(tmp_path, f"{folder}/a.mtl", "newmtl a\nmap_Kd a.png\n")
        written(tmp_path, f"{folder}/a.png", PNG)
        path = written(tmp_path, f"{folder}/a.obj", "mtllib a.mtl\n" + TRIANGLE + "usemtl a\nf 1 2 3\n")
        material = load(path).parts[0].material
        assert material is not None
        assert material["kd"]["texture"] == str(tmp_path / folder / "a.png")


@pytest.mark.parametrize("damage", ["truncated", "garbage", "removed", "indices", "json", "bit"])
def test_a_damaged_entry_is_replaced(tmp_path: Path, own_cache: Path, monkeypatch: pytest.MonkeyPatch, damage: str) -> None:
    path = written(tmp_path, "a.obj", TRIANGLE + "f 1 2 3\n")
    good = only(load(path)).digest
    (entry,) = (own_cache / "glshade" / "meshes").iterdir()
    file = entry / ("entry.json" if damage == "json" else "0.triangles.npy")
    if damage == "removed":
        file.unlink()
    elif damage == "indices":
        np.save(file, np.array([[0, 1, 99]], dtype=np.uint32))
    elif damage == "bit":
        flip_a_bit(file, -1)
    else:
        file.write_bytes(file.read_bytes()[:-4] if damage == "truncated" else b"{garbage")
    forget()
    assert only(load(path)).digest == good
    forget()
    no_parser(monkeypatch)
    assert only(load(path)).digest == good
    assert [p.name for p in entry.parent.iterdir()] == [entry.name], "nothing left over"


def test_an_unwritable_cache_is_done_without(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(written(tmp_path, "occupied", "a file, not a folder")))
    material = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    header, blob = gltf({"POSITION": POSITIONS, "TEXCOORD_0": UVS}, materials=[material])
    header["images"] = [{"uri": "data:image/png;base64," + base64.b64encode(PNG).decode()}]
    header["textures"] = [{"source": 0}]
    found = load(written(tmp_path, "a.glb", glb(header, blob))).parts[0].material
    assert found is not None
    assert Path(found["kd"]["texture"]).read_bytes() == PNG


def test_an_entry_that_was_pruned_is_written_again(tmp_path: Path, own_cache: Path) -> None:
    """A model names the pictures in its entry, so it is read again once they are gone."""
    material = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    header, blob = gltf({"POSITION": POSITIONS, "TEXCOORD_0": UVS}, materials=[material])
    header["images"] = [{"uri": "data:image/png;base64," + base64.b64encode(PNG).decode()}]
    header["textures"] = [{"source": 0}]
    path = written(tmp_path, "a.glb", glb(header, blob))
    model = load(path)
    (entry,) = (own_cache / "glshade" / "meshes").iterdir()
    os.utime(entry, (0, 0))
    assert load(path) is model
    assert entry.stat().st_mtime > 0, "the entry of a model in use is young"
    shutil.rmtree(entry)
    found = load(path).parts[0].material
    assert found is not None
    assert Path(found["kd"]["texture"]).read_bytes() == PNG


@pytest.mark.parametrize("name", ["0.positions.npy", "entry.json", "image"])
def test_a_bit_of_an_entry_flips(name: str, tmp_path: Path, own_cache: Path) -> None:
    """Any bit counts: the last digit of a factor in entry.json would still be valid JSON."""
    material = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0.25}}
    header, blob = gltf({"POSITION": POSITIONS, "TEXCOORD_0": UVS}, materials=[material])
    header["images"] = [{"uri": "data:image/png;base64," + base64.b64encode(PNG).decode()}]
    header["textures"] = [{"source": 0}]
    path = written(tmp_path, "a.glb", glb(header, blob))
    load(path)
    (entry,) = (own_cache / "glshade" / "meshes").iterdir()
    good = {file.name: file.read_bytes() for file in entry.iterdir()}
    (image,) = (file for file in good if not file.endswith((".npy", ".json")))
    file = entry / (image if name == "image" else name)
    flip_a_bit(file, file.read_bytes().index(b"0.25") + 3 if name == "entry.json" else -1)
    forget()
    load(path)
    assert {file.name: file.read_bytes() for file in entry.iterdir()} == good


# --- real files ------------------------------------------------------------------------------------------------------


@pytest.mark.filterwarnings("ignore:.*its animations are not played")
@pytest.mark.parametrize(
    ("name", "parts", "triangles"),
    [
        ("fuze.obj", 1, 1000),
        ("spot.obj", 1, 5856),
        ("suzanne.obj", 1, 968),
        ("teapot.obj", 1, 6320),
        ("Duck.glb", 1, 4212),
        ("CesiumMilkTruck.glb", 5, 3624),
    ],
)
def test_real_files(name: str, parts: int, triangles: int) -> None:
    path = MESHES / name
    if not path.exists():
        pytest.skip(f"{name} is not in ../shared/data/meshes")
    model = load(path)
    assert len(model.parts) == parts
    assert sum(len(part.mesh.triangles) for part in model.parts) == triangles
    forget()
    assert [part.mesh.digest for part in load(path).parts] == [part.mesh.digest for part in model.parts]
    for part in model.parts:
        texture = part.material and part.material["kd"]
        assert not isinstance(texture, dict) or Path(texture["texture"]).is_file()
