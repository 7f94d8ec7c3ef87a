"""Files of cameras that other programs write, and broken ones: they are understood, or one line tells what is wrong."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.command import run_command

from glshade.calibration import file as camera_file
from glshade.calibration import reading
from glshade.calibration.formats import FORMATS
from glshade.errors import AssetError, SceneError
from glshade.scene.camera import Intrinsics, Orthographic
from glshade.scene.file import SceneFile

POSE = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 3], [0, 0, 0, 1]]
FRAME: dict[str, Any] = {"file_path": "a.png", "transform_matrix": POSE, "w": 100, "h": 80, "fl_x": 90}
PICTURE: dict[str, Any] = {
    "file": "a.png",
    "width": 100,
    "height": 80,
    "K": [[90, 0, 50], [0, 90, 40], [0, 0, 1]],
    "R": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "t": [0, 0, 3],
}
BOP: dict[str, Any] = {
    "cam_K": [90, 0, 50, 0, 90, 40, 0, 0, 1],
    "cam_R_w2c": [1, 0, 0, 0, 1, 0, 0, 0, 1],
    "cam_t_w2c": [0, 0, 3000],
}
# name of a format -> (where its file lies, a camera that it holds, how the camera is packed)
KINDS: dict[str, tuple[str, dict[str, Any], Any]] = {
    "nerf": ("transforms.json", FRAME, lambda row: {"frames": [row]}),
    "opencv": ("cameras.json", PICTURE, lambda row: {"pictures": [row]}),
    "bop": ("bop/scene_camera.json", BOP, lambda row: {"0": row}),
}


def _read(folder: Path, name: str, row: Any) -> Any:
    """Returns the only camera of a file that holds a row."""
    place, _, packed = KINDS[name]
    path = folder / place
    path.parent.mkdir(exist_ok=True)
    path.write_text(json.dumps(packed(row)))
    (found,) = camera_file.read(path.parent if FORMATS[name].folder else path)
    return found.calibration


@pytest.mark.parametrize("name", KINDS)
def test_the_plain_camera_is_read(name: str, tmp_path: Path) -> None:
    found = _read(tmp_path, name, KINDS[name][1])
    assert (found.size, found.fx, found.fy, found.cx, found.cy) == ((100, 80), 90, 90, 50, 40)
    assert found.camera_from_world.shape == (4, 4)


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("nerf", {"w": math.inf}, "w must be a finite number"),
        ("nerf", {"w": 10**400}, "w must be a finite number"),
        ("nerf", {"w": 0}, "whole number"),
        ("nerf", {"w": 10.5}, "whole number"),
        ("nerf", {"h": 10**9}, "whole number"),
        ("nerf", {"fl_x": math.nan}, "fl_x must be a finite number"),
        ("nerf", {"fl_x": -5}, "greater than 0"),
        ("nerf", {"fl_x": None, "camera_angle_x": math.pi}, "between 0 and pi"),
        ("nerf", {"fl_x": None, "camera_angle_x": 0}, "between 0 and pi"),
        ("nerf", {"fl_x": None}, "both missing"),
        ("nerf", {"cx": "left"}, "cx must be a finite number"),
        ("nerf", {"k1": 0.1}, "distorted"),
        ("nerf", {"is_fisheye": True}, "fisheye"),
        ("nerf", {"near": math.nan}, "near must be a finite number"),
        ("nerf", {"transform_matrix": [[1], [1, 2], [1]]}, "16 finite numbers"),
        ("nerf", {"transform_matrix": [[1, 0, 0, math.inf], *POSE[1:]]}, "16 finite numbers"),
        ("nerf", {"transform_matrix": [[-1, 0, 0, 0], *POSE[1:]]}, "mirrors"),
        ("nerf", {"transform_matrix": [[0, 0, 0, 0], *POSE[1:]]}, "flattens"),
        ("opencv", {"K": [[90, 7, 50], [0, 90, 40], [0, 0, 1]]}, "skewed"),
        ("opencv", {"K": "abcd"}, "9 finite numbers"),
        ("opencv", {"t": [0, math.nan, 0]}, "3 finite numbers"),
        ("opencv", {"type": "fisheye"}, "fisheye"),
        ("opencv", {"width": math.inf}, "width must be a finite number"),
        ("opencv", {"height": None}, "height must be a finite number"),
        ("bop", {"cam_K": [90, 0]}, "9 finite numbers"),
        ("bop", {"cam_K": [90, 0, math.inf, 0, 90, 40, 0, 0, 1]}, "9 finite numbers"),
        ("bop", {"cam_t_w2c": [1]}, "3 finite numbers"),
        ("bop", {"width": -3}, "whole number"),
    ],
)
def test_wrong_numbers_are_told(name: str, change: dict[str, Any], message: str, tmp_path: Path) -> None:
    with pytest.raises(AssetError, match=message) as told:
        _read(tmp_path, name, {**KINDS[name][1], **change})
    assert str(told.value).startswith(str(tmp_path))
    assert "\n" not in str(told.value)


JUNK = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=3) | st.just(10**400),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=3), inner, max_size=2),
    max_leaves=6,
)


@given(st.data())
def test_no_value_is_a_traceback(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    name = data.draw(st.sampled_from(sorted(KINDS)))
    good = KINDS[name][1]
    row = data.draw(st.fixed_dictionaries({key: st.just(value) | JUNK for key, value in good.items()}) | JUNK)
    try:
        found = _read(tmp_path_factory.getbasetemp(), name, row)
    except AssetError as error:
        told = str(error)
    else:
        told = ""
    assert "\n" not in told
    if told:
        return
    assert np.isfinite(found.world_from_camera).all()
    assert np.isfinite([found.fx, found.fy, found.cx, found.cy, found.near, found.far]).all()
    assert min(found.fx, found.fy, *found.size) > 0


def test_keys_without_a_value_count_as_left_out(tmp_path: Path) -> None:
    found = _read(
        tmp_path, "nerf", {**FRAME, "cx": None, "cy": None, "near": None, "fl_x": None, "camera_angle_y": math.pi / 2}
    )
    assert (found.cx, found.cy, found.near) == (50, 40, 0)
    assert found.fx == found.fy == pytest.approx(40)


def test_colmap_as_it_is_found(tmp_path: Path) -> None:
    # An empty line after the comments, a lens that no picture uses, and a model whose coefficients are all 0.
    (tmp_path / "cameras.txt").write_text(
        "# Camera list\n\n1 FULL_OPENCV 100 80 90 91 50 40 0 0 0 0 0 0 0 0\n2 OPENCV_FISHEYE 9 9 9 9 4 4 1 1 1 1\n"
    )
    (tmp_path / "images.txt").write_text(
        "# Image list\n\n1 1 0 0 0 0 0 3 1 a.png\n1.0 2.0 -1 3.0 4.0 -1\n2 1 0 0 0 0 0 4 1 b.png\n\n"
    )
    first, second = camera_file.read(tmp_path)
    assert (first.name, second.name) == ("a.png", "b.png")
    assert (first.calibration.fx, first.calibration.fy) == (90, 91)
    np.testing.assert_array_equal(second.calibration.world_from_camera[:3, 3], [0, 0, -4])


@pytest.mark.parametrize(
    ("camera", "image", "message"),
    [
        ("1 PINHOLE 100 80 90", "1 1 0 0 0 0 0 3 1 a.png", "needs 4 parameters"),
        ("1 PINHOLE -1 80 90 90 50 40", "1 1 0 0 0 0 0 3 1 a.png", "whole number"),
        ("1 PINHOLE x 80 90 90 50 40", "1 1 0 0 0 0 0 3 1 a.png", "finite number"),
        ("1", "1 1 0 0 0 0 0 3 1 a.png", "needs MODEL"),
        ("1 PINHOLE 100 80 90 90 50 40", "1 0 0 0 0 0 0 3 1 a.png", "must not be 0"),
        ("1 PINHOLE 100 80 90 90 50 40", "1 nan 0 0 0 0 0 3 1 a.png", "4 finite numbers"),
        ("1 PINHOLE 100 80 90 90 50 40", "1 1 0 0 0 0 inf 3 1 a.png", "3 finite numbers"),
        ("1 PINHOLE 100 80 90 90 50 40", "1 1 0 0", "an image needs"),
        ("1 PINHOLE 100 80 90 90 50 40", "1 1 0 0 0 0 0 3 2 a.png", "no camera 2"),
    ],
)
def test_wrong_texts_of_colmap(camera: str, image: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "cameras.txt").write_text(camera + "\n")
    (tmp_path / "images.txt").write_text(image + "\n\n")
    with pytest.raises(AssetError, match=message) as told:
        camera_file.read(tmp_path)
    assert str(told.value).startswith(str(tmp_path))


SCENE = """
film = { size = [24, 16] }
camera = { eye = [0, 0, 4], target = [0, 0, 0] }
cameras.flat = { type = "orthographic", eye = [3, 0, 1], target = [0, 0, 0] }
objects = [{ shape = { type = "sphere", segments = 12, rings = 6 }, material = { brdf = "lambert" } }]
"""


def test_overrides_belong_to_the_camera_that_is_seen_through(tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text(SCENE)
    # The scene's own camera has neither of these keys.
    flat = SceneFile(tmp_path / "s.toml", {"camera.height": 3.0}).scene(camera="flat")
    assert isinstance(flat.camera, Orthographic)
    assert flat.camera.height == 3.0
    (tmp_path / "cameras.json").write_text(json.dumps({"pictures": [PICTURE]}))
    pairs = [("cameras_from", '"cameras.json"'), ("camera.fx", "45")]
    seen = SceneFile(tmp_path / "s.toml", pairs).scene(camera="a")
    assert isinstance(seen.camera, Intrinsics)
    assert (seen.camera.fx, seen.camera.fy) == (45, 90)
    with pytest.raises(SceneError, match=r"camera\.fx: unknown key.*from --set"):
        SceneFile(tmp_path / "s.toml", {"camera.fx": 45.0}).scene()


def test_the_camera_of_a_file_is_changed_in_a_batch_of_a_sampled_scene(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "s.toml").write_text(SCENE + '[[sample.values]]\nkey = "objects.0.category"\nchoice = ["ball"]\n')
    pictures = [{**PICTURE, "file": name, "K": [[20, 0, 12], [0, 20, 8], [0, 0, 1]]} for name in ("a", "b")]
    (tmp_path / "from.json").write_text(json.dumps({"pictures": pictures}))
    paths = [str(tmp_path / name) for name in ("s.toml", "from.json", "{camera}.png", "to.json")]
    command = ["render", paths[0], "--cameras-from", paths[1], "-o", paths[2], "--cameras", paths[3], "--jobs", "1"]
    ran = run_command(capsys, *command, "--set", "camera.fx=30")
    assert ran.code == 0, ran.out + ran.err
    seen = [found.calibration for found in camera_file.read(tmp_path / "to.json")]
    # The film has 24 x 16 pixels, while the numbers of the cameras belong to 100 x 80.
    np.testing.assert_allclose([(each.fx, each.fy) for each in seen], [(30 * 24 / 100, 20 * 16 / 80)] * 2)


@pytest.mark.parametrize("name", KINDS)
def test_too_many_cameras_are_refused_before_they_are_understood(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reading, "MOST_CAMERAS", 0)
    with pytest.raises(AssetError, match="holds 1 cameras; 0 can be read"):
        _read(tmp_path, name, KINDS[name][1])


def _render(folder: Path, capsys: pytest.CaptureFixture[str], *more: str) -> tuple[int, str]:
    ran = run_command(
        capsys, "render", str(folder / "s.toml"), "-f", "1-2", "-o", str(folder / "out" / "##.png"), "--jobs", "1", *more
    )
    return ran.code, ran.out + ran.err


@pytest.mark.parametrize(
    ("camera", "place", "kind", "message"),
    [
        ("perspective", "there.json", "opencv", "is a folder"),
        ("perspective", "s.toml/cameras.json", "opencv", "cannot be made"),
        ("orthographic", "colmap", "colmap", "nerf and opencv do"),
        ("orthographic", "bop", "bop", "no orthographic camera"),
    ],
)
def test_a_place_without_use_is_told_before_a_picture_is_drawn(
    camera: str, place: str, kind: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "s.toml").write_text(SCENE)
    (tmp_path / "there.json").mkdir()
    code, told = _render(
        tmp_path, capsys, "--set", f"camera.type={camera}", "--cameras", str(tmp_path / place), "--cameras-format", kind
    )
    assert code == 1
    assert message in told
    assert not list(tmp_path.glob("out/*.png"))


def test_the_folder_of_the_cameras_is_made(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "s.toml").write_text(SCENE)
    path = tmp_path / "new" / "deep" / "transforms.json"
    code, told = _render(tmp_path, capsys, "--cameras", str(path))
    assert code == 0, told
    assert [found.name for found in camera_file.read(path)] == ["../../out/01.png", "../../out/02.png"]
