"""Named cameras: they move, take overrides, and bring the size of a calibrated picture."""

from __future__ import annotations

from pathlib import Path

import pytest

from glshade.errors import SceneError
from glshade.scene.file import SceneFile

SCENE = """
[camera]
eye = [0, 0, 9]
[cameras.side]
eye = [4, 0, 0]
fov = 30
[cameras.calibrated]
type = "intrinsics"
fx = 100
fy = 100
cx = 32
cy = 24
width = 64
height = 48
[[animation]]
key = "cameras.side.fov"
frames = [0, 10]
values = [20, 60]
[[objects]]
shape = "cube"
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "s.toml").write_text(SCENE)
    return tmp_path / "s.toml"


def test_they_move(path: Path) -> None:
    file = SceneFile(path)
    assert [file.scene(frame, "side").camera.fov for frame in (0, 5, 10, None)] == [20, 40, 60, 30]
    assert file.scene(5).camera.eye == (0, 0, 9)


def test_an_override_of_the_camera_is_one_of_the_chosen_camera(path: Path) -> None:
    file = SceneFile(path, [("camera.fov", "15"), ("camera.turn", "90")])
    for camera, eye in (("side", (4, 0, 0)), (None, (0, 0, 9))):
        seen = file.scene(None, camera).camera
        assert (seen.fov, seen.turn, seen.eye) == (15, 90, eye)
    assert file.scene(5, "side").camera.fov == 15
    with pytest.raises(SceneError, match=r"camera\.fov: "):
        SceneFile(path, [("camera.fov", "500")]).scene(None, "side")


def test_a_calibrated_camera_brings_its_size(path: Path) -> None:
    file = SceneFile(path)
    assert file.scene(None, "calibrated").film.size == (64, 48)
    assert file.scene(None, "side").film.size == (512, 512)
    assert SceneFile(path, [("film.size", "[30, 20]")]).scene(None, "calibrated").film.size == (30, 20)
