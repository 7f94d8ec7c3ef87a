"""Files of cameras: points fall on their pixels in each format, and what is read back draws the same picture."""

from __future__ import annotations

import json
import math
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.command import run_command

import glshade
from glshade.assembly.assembly import assemble
from glshade.calibration import file as camera_file
from glshade.calibration.calibration import CalibratedPicture, Calibration
from glshade.calibration.rotation import inverse_pose, nearest_rotation, pose_of, quaternion, rotation_of
from glshade.errors import AssetError, GlshadeError
from glshade.image.openimageio import attributes

# The middles of these small bright balls are looked for in the picture.
BALLS = ((0.0, 0.0, 0.0), (0.7, 0.4, -0.3), (-0.6, -0.5, 0.4))
RADIUS = 0.02

CAMERAS: dict[str, dict[str, Any]] = {
    "fitted": {"fit": True, "eye": (1.0, 0.7, 2.0)},
    "plain": {"eye": (0.3, 0.2, 3.0), "target": (0, 0, 0)},
    "orthographic": {"type": "orthographic", "eye": (1.0, 2.0, 3.0), "target": (0, 0, 0), "height": 2.5},
    "off centre": {
        "type": "intrinsics",
        "fx": 310.0,
        "fy": 250.0,
        "cx": 110.0,
        "cy": 61.5,
        "width": 240,
        "height": 180,
        "matrix": np.block([[np.eye(3), np.array([[0.1], [0.05], [3.0]])], [np.zeros((1, 3)), np.ones((1, 1))]]).tolist(),
    },
}
FILMS: dict[str, dict[str, Any]] = {
    "plain": {},
    "cropped": {"crop": (5, 3, 230, 172)},
    "supersampled": {"supersample": 2},
}


def _scene(camera: str, film: str = "plain", **more: Any) -> glshade.Scene:
    return glshade.Scene(
        objects=[
            {
                "name": f"ball{number}",
                "shape": {"type": "sphere", "segments": 48, "rings": 24},
                "transform": {"translate": place, "scale": RADIUS},
                "material": {"brdf": "lambert", "kd": 1.0},
            }
            for number, place in enumerate(BALLS)
        ],
        lights=[{"type": "ambient", "intensity": 1.0}],
        film={"size": (240, 180), **FILMS[film]},
        camera=CAMERAS[camera],
        **more,
    )


def _middles(picture: glshade.Image) -> list[np.ndarray]:
    """Returns the middles (x, y) of the bright spots of a picture, from its top left corner [pixels]."""
    from scipy.ndimage import center_of_mass, label

    bright = np.asarray(picture)[..., 0]
    spots, count = label(bright > 0, np.ones((3, 3)))
    return [np.array(place)[::-1] + 0.5 for place in center_of_mass(bright, spots, range(1, count + 1))]


@pytest.mark.parametrize("film", FILMS)
@pytest.mark.parametrize("camera", CAMERAS)
def test_points_fall_on_their_pixels(camera: str, film: str) -> None:
    picture = glshade.render(_scene(camera, film), dtype="float32")
    assert picture.calibration is not None
    assert picture.calibration.size == picture.pixels.shape[1::-1]
    expected = picture.calibration.project(BALLS)
    found = _middles(picture)
    assert len(found) == len(BALLS)
    for place in expected:
        # The outline of a ball is a polygon of whole pixels, whose middle is off by a part of a pixel.
        assert min(np.abs(place - middle).max() for middle in found) < 0.25


@pytest.mark.parametrize("camera", CAMERAS)
def test_exact_places(camera: str) -> None:
    """The calibration is compared with the matrix by which the picture is drawn."""
    scene = _scene(camera, "cropped")
    assembly = assemble(scene)
    x, y, *_ = scene.film.window
    points = np.array(BALLS)
    clip = np.column_stack([points - assembly.view.eye, np.ones(len(points))]) @ assembly.view.clip_from_world().T
    shown = (clip[:, :2] / clip[:, 3:] + 1) / 2 * scene.film.size - (x, y)
    np.testing.assert_allclose(assembly.calibration(scene).project(points), shown, atol=1e-9)


def _projected(name: str, path: Path) -> np.ndarray:
    """Returns the pixels (3, 2) of BALLS by the formulas of each format, written out from its own files."""
    points = np.array(BALLS)
    if name == "opencv":
        row = json.loads(path.read_text())["pictures"][0]
        seen = points @ np.array(row["R"]).T + row["t"]
        seen = seen @ np.array(row["K"]).T if row["type"] == "perspective" else seen
        if row["type"] == "orthographic":
            k = np.array(row["K"])
            return seen[:, :2] * (k[0, 0], k[1, 1]) + (k[0, 2], k[1, 2])
        return seen[:, :2] / seen[:, 2:]
    if name == "nerf":
        data = json.loads(path.read_text())
        frame = data | data["frames"][0]
        local = (np.linalg.inv(frame["transform_matrix"]) @ np.column_stack([points, np.ones(3)]).T).T
        depth = -local[:, 2] if frame["camera_model"] == "PINHOLE" else 1.0
        return np.column_stack(
            [frame["cx"] + frame["fl_x"] * local[:, 0] / depth, frame["cy"] - frame["fl_y"] * local[:, 1] / depth]
        )
    if name == "colmap":
        _, model, _, _, fx, fy, cx, cy = (path / "cameras.txt").read_text().splitlines()[1].split()
        assert model == "PINHOLE"
        _, w, x, y, z, *t, camera, _ = (path / "images.txt").read_text().splitlines()[2].split()
        assert camera == "1"
        seen = points @ rotation_of([float(w), float(x), float(y), float(z)]).T + [float(each) for each in t]
        return seen[:, :2] / seen[:, 2:] * (float(fx), float(fy)) + (float(cx), float(cy))
    row = json.loads((path / "scene_camera.json").read_text())["0"]
    poses = json.loads((path / "scene_gt.json").read_text())["0"]
    assert [pose["obj_id"] for pose in poses] == [1, 2, 3]
    # The middle of each model is the origin of its space.
    seen = np.array([pose["cam_t_m2c"] for pose in poses]) / 1000
    k = np.array(row["cam_K"]).reshape(3, 3)
    return (seen @ k.T)[:, :2] / seen[:, 2:]


@pytest.mark.parametrize("name", ["nerf", "opencv", "colmap", "bop"])
@pytest.mark.parametrize("camera", CAMERAS)
def test_each_format_projects_and_reads_back(camera: str, name: str, tmp_path: Path) -> None:
    scene = _scene(camera, "cropped")
    seen = assemble(scene).calibration(scene)
    path = tmp_path / "cameras.json" if name in ("nerf", "opencv") else tmp_path
    pictures = [CalibratedPicture("a/0001.png", seen)]
    if camera == "orthographic" and name in ("colmap", "bop"):
        with pytest.raises(GlshadeError, match=r"0001\.png"):
            camera_file.write(path, pictures, name)
        return
    camera_file.write(path, pictures, name)
    np.testing.assert_allclose(_projected(name, path), seen.project(BALLS), atol=1e-9)
    (back,) = camera_file.read(path)
    assert back.name == "a/0001.png"
    assert back.calibration.size == seen.size
    np.testing.assert_allclose(back.calibration.project(BALLS), seen.project(BALLS), atol=1e-9)
    assert list(camera_file.named(path)) == ["0001"]


@pytest.mark.parametrize("name", ["nerf", "opencv", "colmap", "bop"])
def test_what_is_read_back_draws_the_same_pixels(name: str, tmp_path: Path) -> None:
    scene = _scene("off centre")
    picture = glshade.render(scene)
    assert picture.calibration is not None
    path = tmp_path / "cameras.json" if name in ("nerf", "opencv") else tmp_path
    camera_file.write(path, [CalibratedPicture("one.png", picture.calibration)], name)
    again = glshade.Scene.model_validate({**scene.model_dump(exclude={"camera"}), "cameras_from": path})
    through = again.through(again.cameras["one"])
    assert np.array_equal(np.asarray(glshade.render(through)), np.asarray(picture))


def test_files_say_how_they_were_seen(tmp_path: Path) -> None:
    scene = _scene("fitted", "cropped")
    picture = glshade.render(scene, dtype="float32")
    for suffix in ("exr", "png", "jpg", "tif"):
        picture.save(tmp_path / f"a.{suffix}")
    stored = json.loads(attributes(tmp_path / "a.png")["glshade:camera"])
    seen = Calibration.from_dict(stored)
    assert picture.calibration is not None
    assert np.array_equal(seen.project(BALLS), picture.calibration.project(BALLS))
    np.testing.assert_allclose(
        stored["objects"]["ball1"], [[0.02, 0, 0, 0.7], [0, 0.02, 0, 0.4], [0, 0, 0.02, -0.3], [0, 0, 0, 1]]
    )
    assert json.loads(attributes(tmp_path / "a.exr")["glshade:camera"]) == stored

    import OpenImageIO as oiio

    spec = oiio.ImageInput.open(str(tmp_path / "a.exr")).spec()
    found = {each.name: np.array(each.value).reshape(4, 4) for each in spec.extra_attribs if each.name.startswith("worldTo")}
    row = np.column_stack([BALLS, np.ones(3)])
    ndc = row @ found["worldToNDC"]
    x, y, *_ = scene.film.window
    # The display window is the whole picture.
    shown = ndc[:, :2] / ndc[:, 3:] * scene.film.size - (x, y)
    np.testing.assert_allclose(shown, picture.calibration.project(BALLS), atol=1e-3)
    depth = (row @ found["worldToCamera"])[:, 2]
    assert (depth > 0).all()
    assert b"worldToCamera\0m44f" in (tmp_path / "a.exr").read_bytes()
    assert b"worldToNDC\0m44f" in (tmp_path / "a.exr").read_bytes()


SCENE = """
[film]
size = [48, 32]
[cameras.left]
eye = [-2, 0, 2]
[cameras.right]
eye = [2, 0, 2]
[[objects]]
shape = "cube"
"""


def test_a_batch_writes_and_reads_cameras(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    run = partial(run_command, capsys)
    monkeypatch.chdir(tmp_path)
    Path("s.toml").write_text(SCENE)
    command = ["render", "s.toml", "--camera", "left", "--camera", "right", "-o", "out/{camera}.png", "--jobs", "1"]
    assert run(*command, "--cameras", "out/transforms.json").code == 0
    frames = json.loads(Path("out/transforms.json").read_text())["frames"]
    assert [frame["file_path"] for frame in frames] == ["left.png", "right.png"]
    lines = [json.loads(line) for line in Path("out/manifest.jsonl").read_text().splitlines()]
    poses = [
        next(line["seen"] for line in lines if line["output"] == name)["world_from_camera"]
        for name in ("left.png", "right.png")
    ]
    assert poses == [frame["transform_matrix"] for frame in frames]
    # Pictures that exist tell their cameras themselves.
    first = Path("out/transforms.json").read_bytes()
    Path("out/transforms.json").unlink()
    assert run(*command, "--resume", "--cameras", "out/transforms.json").code == 0
    assert Path("out/transforms.json").read_bytes() == first
    again = run("render", "s.toml", "--cameras-from", "out/transforms.json", "-o", "again/{camera}.exr", "--jobs", "1").code
    assert again == 0, again.output
    assert sorted(path.name for path in Path("again").glob("*.exr")) == ["left.exr", "right.exr"]
    bad = run("render", "s.toml", "--cameras-format", "nerf").code
    assert bad == 2


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "is not JSON"),
        ("[]", "not a table"),
        ('{"frames": []}', "holds no cameras"),
        ('{"frames": [{"file_path": "a"}]}', "a: w and h are missing"),
        ('{"w": 4, "h": 4, "frames": [{"file_path": "a", "fl_x": 1}]}', "'transform_matrix' is missing"),
        ('{"w": 4, "h": 4, "frames": [{"file_path": "a", "fl_x": 1, "k1": 0.1}]}', "a: its lens is distorted"),
        ('{"w": 4, "h": 4, "frames": [{"file_path": "a", "fl_x": 1, "camera_model": "EQUIRECTANGULAR"}]}', "EQUIRECTANGULAR"),
        ('{"w": 4, "h": 4, "frames": [{"file_path": "a", "fl_x": 1, "transform_matrix": [[0]]}]}', "16 finite numbers"),
        ('{"pictures": [{"file": "a", "K": [1]}]}', "a: 'R' is missing"),
        ('{"other": 1}', "in a format that is known"),
    ],
)
def test_bad_files_are_told(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "cameras.json"
    path.write_text(text)
    with pytest.raises(AssetError) as told:
        camera_file.read(path)
    assert str(told.value).startswith(str(path))
    assert message in str(told.value)
    assert "\n" not in str(told.value)


def test_lenses_of_colmap(tmp_path: Path) -> None:
    (tmp_path / "images.txt").write_text("1 1 0 0 0 0 0 0 7 a b.png\n\n2 1 0 0 0 1 0 0 7 c.png\n3 4\n")
    (tmp_path / "cameras.txt").write_text("7 SIMPLE_RADIAL 40 30 50 20 15 0\n")
    assert [picture.name for picture in camera_file.read(tmp_path)] == ["a b.png", "c.png"]
    (tmp_path / "cameras.txt").write_text("7 SIMPLE_RADIAL 40 30 50 20 15 0.1\n")
    with pytest.raises(AssetError, match="distorted"):
        camera_file.read(tmp_path)
    (tmp_path / "cameras.txt").unlink()
    (tmp_path / "cameras.bin").write_bytes(b"\0")
    with pytest.raises(AssetError, match="model_converter"):
        camera_file.read(tmp_path)


angles = st.tuples(*[st.floats(-math.pi, math.pi)] * 3)


@given(angles)
def test_quaternions_and_poses_come_back(given_angles: tuple[float, float, float]) -> None:
    from scipy.spatial.transform import Rotation

    rotation = Rotation.from_euler("xyz", given_angles).as_matrix()
    np.testing.assert_allclose(rotation_of(quaternion(rotation)), rotation, atol=1e-12)
    pose = pose_of(rotation, [1, 2, 3], "one")
    np.testing.assert_allclose(inverse_pose(pose) @ pose, np.eye(4), atol=1e-12)
    found, distance = nearest_rotation(np.round(rotation, 3))
    assert distance <= 2e-3
    np.testing.assert_allclose(found @ found.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(found, rotation, atol=2e-3)


def test_a_rounded_pose_is_drawn_with_a_warning() -> None:
    matrix = np.eye(4)
    matrix[:3, :3] = np.round(rotation_of([0.9, 0.1, 0.3, 0.2]), 3)
    matrix[2, 3] = 4.0
    scene = _scene("plain").model_copy(update={"camera": glshade.Perspective(matrix=matrix.tolist())})
    with pytest.warns(UserWarning, match="off a rotation by"):
        assemble(scene)
    mirrored = np.diag([1.0, 1.0, -1.0, 1.0])
    with pytest.raises(ValueError, match="mirrors"):
        glshade.Perspective(matrix=mirrored.tolist())


def test_both_conventions_are_the_same_camera() -> None:
    opengl = np.eye(4)
    opengl[:3, :3], opengl[:3, 3] = rotation_of([0.9, 0.1, 0.3, 0.2]), (1, 2, 3)
    opencv = opengl @ np.diag([1.0, -1.0, -1.0, 1.0])
    views = [
        glshade.Perspective(matrix=matrix.tolist(), convention=name).view(np.array(BALLS), 1.5)
        for name, matrix in (("opengl", opengl), ("opencv", opencv))
    ]
    np.testing.assert_allclose(views[0].axes, views[1].axes, atol=1e-15)
    assert views[0].near == pytest.approx(views[1].near)
