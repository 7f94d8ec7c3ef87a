"""Up: the axis of a bare mesh file that points up in its picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.command import run_command

import glshade
from glshade.errors import SceneError
from glshade.scene.up import CHOICES

# A triangle in the plane of y and z, in each format.
STL = b"solid a\nfacet normal 1 0 0\nouter loop\nvertex 0 0 0\nvertex 0 1 0\nvertex 0 0 1\nendloop\nendfacet\nendsolid a\n"
OBJ = b"v 0 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n"
PLY = (
    b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
    b"property list uchar int vertex_indices\nend_header\n0 0 0\n0 1 0\n0 0 1\n3 0 1 2\n"
)
OFF = b"OFF\n3 1 0\n0 0 0\n0 1 0\n0 0 1\n3 0 1 2\n"
FILES = {".stl": STL, ".obj": OBJ, ".ply": PLY, ".off": OFF}


def transform(tmp_path: Path, suffix: str, overrides: object = ()) -> np.ndarray:
    """Returns the linear transform (3, 3) of the only object of the scene that a bare mesh makes."""
    path = tmp_path / f"mesh{suffix}"
    path.write_bytes(FILES[suffix])
    scene = glshade.load(path, overrides)  # type: ignore[arg-type]
    return scene.objects[0].transform.array()[:3, :3]


@pytest.mark.parametrize("suffix", FILES)
@pytest.mark.parametrize(("up", "axis"), [("x", 0), ("y", 1), ("z", 2)])
def test_the_axis_points_up(tmp_path: Path, suffix: str, up: str, axis: int) -> None:
    linear = transform(tmp_path, suffix, {"up": up})
    np.testing.assert_allclose(linear @ np.eye(3)[axis], [0, 1, 0], atol=1e-12)
    assert np.linalg.det(linear) == pytest.approx(1), "it is a rotation, so that a face still shows its front"


@pytest.mark.parametrize(("suffix", "axis"), [(".stl", 2), (".obj", 1), (".ply", 1), (".off", 1)])
def test_auto_follows_the_format(tmp_path: Path, suffix: str, axis: int) -> None:
    for overrides in ((), {"up": "auto"}):
        np.testing.assert_allclose(transform(tmp_path, suffix, overrides) @ np.eye(3)[axis], [0, 1, 0], atol=1e-12)


def test_set_comes_after_up(tmp_path: Path) -> None:
    pairs = [("up", "x"), ("objects.0.transform.rotate", "[0, 0, 0]")]
    np.testing.assert_allclose(transform(tmp_path, ".stl", pairs), np.eye(3), atol=1e-12)


def test_a_wrong_axis_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="up = 'w' is not an axis; known: x, y, z, auto"):
        transform(tmp_path, ".obj", {"up": "w"})


def test_a_scene_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "s.toml"
    path.write_text('[[objects]]\nshape = "sphere"\n')
    for overrides in ({"up": "z"}, [("up", "z")]):
        with pytest.raises(SceneError, match="--up is for mesh files"):
            glshade.load(path, overrides)  # type: ignore[arg-type]


def test_the_option_chooses_the_axis(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "mesh.obj"
    path.write_bytes(OBJ)
    cameras = {}
    for up in CHOICES:
        output = tmp_path / f"{up}.exr"
        result = run_command(capsys, "render", path, "--up", up, "--size", "16x16", "--samples", "1", "-o", output)
        assert result.code == 0, result.err
        from glshade.image.file import read

        cameras[up] = read(output)[0]
    assert np.array_equal(cameras["auto"], cameras["y"])
    assert not np.array_equal(cameras["x"], cameras["y"])
    assert not np.array_equal(cameras["z"], cameras["y"])
