"""Mesh files name other files only in their own folder and in the folders of the scene's files (docs/security.md)."""

from __future__ import annotations

import base64
import json
import os
import warnings
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import pytest
from support.command import run_command

from glshade import AssetError, Image, load
from glshade.limits import Limits
from glshade.mesh import file as mesh_file
from glshade.mesh.file import AssetWarning

POSITIONS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype="<f4").tobytes()
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nmtllib {library}\nusemtl m\nf 1/1 2/2 3/3\n"


@pytest.fixture(autouse=True)
def fresh_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    mesh_file._memory.clear()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder `mesh` beside a folder `other`, with the files of a secret, a texture and materials in the latter."""
    folder, other = tmp_path / "mesh", tmp_path / "other"
    folder.mkdir()
    other.mkdir()
    (other / "secret.txt").write_bytes(POSITIONS)
    Image(np.full((2, 2, 3), 0.5, dtype=np.float32)).save(other / "texture.png")
    (other / "m.mtl").write_text("newmtl m\nKd 1 0 0\n")
    (folder / "link").symlink_to(other)
    (folder / "secret.lnk").symlink_to(other / "secret.txt")
    return folder


def gltf(folder: Path, uri: str) -> Path:
    """Writes a glTF file with one triangle whose buffer has this URI, and returns its path."""
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": uri, "byteLength": 36}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
    }
    (folder / "m.gltf").write_text(json.dumps(document))
    return folder / "m.gltf"


def obj(folder: Path, library: str, materials: str | None = None) -> Path:
    """Writes an OBJ file that names a material library, and the library if its text is given; returns the OBJ file's path."""
    (folder / "m.obj").write_text(TRIANGLE.format(library=library))
    if materials is not None:
        (folder / library).write_text(materials)
    return folder / "m.obj"


def ways_out(folder: Path, name: str) -> list[str]:
    """Returns names that lead from the folder to the file `name` in the folder `other`."""
    other = folder.parent / "other"
    return [f"../other/{name}", f"..\\other\\{name}", str(other / name), f"link/{name}", f"./link/../other/{name}"]


@pytest.mark.parametrize("way", [*range(5), "percent-encoded", "a link to the file"])
def test_a_buffer_outside(folder: Path, way: Any) -> None:
    ways = {"percent-encoded": quote("../other/secret.txt", safe="").replace(".", "%2E"), "a link to the file": "secret.lnk"}
    path = gltf(folder, ways[way] if way in ways else ways_out(folder, "secret.txt")[way])
    with pytest.raises(AssetError, match=r"m\.gltf: buffers\[0\]\.uri: .* lies outside .*--allow-outside") as error:
        load(path)
    assert len(error.value.problems) == 1
    assert len(load(path, allow_outside=True).objects) == 1


def test_a_buffer_inside(folder: Path) -> None:
    (folder / "deep").mkdir()
    (folder / "deep" / "b 1.bin").write_bytes(POSITIONS)
    for uri in ("deep/b%201.bin", "deep\\b%201.bin", str(folder / "deep" / "b 1.bin"), "deep/../deep/B%201.BIN"):
        load(gltf(folder, uri))
    load(gltf(folder, "data:application/octet-stream;base64," + base64.b64encode(POSITIONS).decode()))


@pytest.mark.parametrize("way", range(5))
def test_a_library_outside_is_left_out_with_a_warning(folder: Path, way: int) -> None:
    path = obj(folder, ways_out(folder, "m.mtl")[way])
    with pytest.warns(AssetWarning, match=r"material file .* lies outside .*--allow-outside"):
        (part,) = mesh_file.load(path).parts
    assert part.material is None
    (part,) = mesh_file.load(path, Limits(allow_outside=True)).parts
    assert part.material is not None
    # The answer to a reader who may look outside is not given to one who may not.
    assert mesh_file.load(path).parts[0].material is None


@pytest.mark.parametrize("statement", ["map_Kd", "bump", "norm", "map_bump"])
@pytest.mark.parametrize("way", range(5))
def test_a_texture_outside_is_left_out_with_a_warning(folder: Path, way: int, statement: str) -> None:
    path = obj(folder, "m.mtl", f"newmtl m\n{statement} {ways_out(folder, 'texture.png')[way]}\n")
    with pytest.warns(AssetWarning, match=r"texture .* lies outside .*--allow-outside"):
        (part,) = mesh_file.load(path).parts
    assert "texture.png" not in json.dumps(part.material)
    (part,) = mesh_file.load(path, Limits(allow_outside=True)).parts
    assert "texture.png" in json.dumps(part.material)


def test_a_texture_of_a_ply_file_outside(folder: Path) -> None:
    header = "ply\nformat ascii 1.0\ncomment TextureFile ../other/texture.png\nelement vertex 3\n"
    header += (
        "".join(f"property float {name}\n" for name in "xyzst") + "element face 1\nproperty list uchar int vertex_indices\n"
    )
    (folder / "m.ply").write_text(header + "end_header\n0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 1\n3 0 1 2\n")
    with pytest.warns(AssetWarning, match="lies outside"):
        assert mesh_file.load(folder / "m.ply").parts[0].material is None


def test_the_folders_that_the_scene_names_are_inside(folder: Path) -> None:
    obj(folder, "m.mtl", "newmtl m\nmap_Kd ../other/texture.png\n")
    scene = folder / "s.toml"
    own = 'materials.a = { brdf = "lambert", kd = { texture = "../other/texture.png" } }\n'
    scene.write_text(own + '[[objects]]\nmesh = "m.obj"\n')
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        load(scene)
    scene.write_text('[[objects]]\nmesh = "m.obj"\n')
    with pytest.warns(AssetWarning, match="lies outside"):
        load(scene)


def test_a_texture_that_becomes_a_link_to_the_outside(folder: Path) -> None:
    """The entry of the cache folder was written while the texture was a file of the folder."""
    path = obj(folder, "m.mtl", "newmtl m\nmap_Kd texture.png\n")
    (folder / "texture.png").write_bytes((folder.parent / "other" / "texture.png").read_bytes())
    assert "texture.png" in json.dumps(mesh_file.load(path).parts[0].material)
    mesh_file._memory.clear()
    (folder / "texture.png").unlink()
    (folder / "texture.png").symlink_to(folder.parent / "other" / "texture.png")
    with pytest.warns(AssetWarning, match="lies outside"):
        assert "texture.png" not in json.dumps(mesh_file.load(path).parts[0].material)


def test_on_the_command_line(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = gltf(folder, "../other/secret.txt")
    result = run_command(capsys, "explain", path)
    assert result.code == 3
    assert result.err.count("\n") == 1
    assert "--allow-outside" in result.err
    assert run_command(capsys, "explain", path, "--allow-outside").code == 0


@pytest.mark.parametrize("name", ["a" * 5000, "x\0y", "a/" * 3000 + "b", "~nosuchuser/x"])
def test_names_that_no_file_can_have(folder: Path, name: str) -> None:
    with pytest.raises(AssetError) as error:
        load(gltf(folder, name))
    assert len(str(error.value)) < 1000
    with pytest.warns(AssetWarning, match="texture"):
        mesh_file.load(obj(folder, "m.mtl", f"newmtl m\nmap_Kd {name}\n"))


def test_a_fifo_is_no_texture(folder: Path) -> None:
    os.mkfifo(folder / "t.png")
    with pytest.warns(AssetWarning, match="not found"):
        mesh_file.load(obj(folder, "m.mtl", "newmtl m\nmap_Kd t.png\n"))
