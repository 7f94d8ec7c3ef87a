"""Writing: values go back into the scene file, and everything else in it stays as it was."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from typing import Any

import pytest

from glshade import SceneError, load
from glshade.live.writing import Changed, write

SCENE = """# A scene.
description = "test"   # in words

[film]
size = [64, 32] # small

[materials.body]   # of the ball
brdf = "phong"
kd = [0.5, 0.2, 0.1]  # brownish
ks = 0.3        # strong

# The ball.
[[objects]]
name = "ball"
shape = "sphere"   # round
material = "body"

[[lights]]
type = "directional"   # the sun
direction = [-1, -1, -1]
intensity = 1
"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    return path


def digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_values_are_replaced_where_they_stand(scene: Path) -> None:
    write(
        scene, {"materials.body.kd": [0.1, 0.25, 1], "lights.0.intensity": 2.5, "objects.ball.material": "gold"}, digest(scene)
    )
    expected = SCENE.replace("[0.5, 0.2, 0.1]", "[0.1, 0.25, 1]").replace("intensity = 1\n", "intensity = 2.5\n")
    assert scene.read_text() == expected.replace('material = "body"', 'material = "gold"')


@pytest.mark.parametrize(
    ("values", "line", "after"),
    [
        ({"materials.body.exponent": 12.5}, "exponent = 12.5", "ks = 0.3        # strong"),
        ({"objects.0.shading": "flat"}, 'shading = "flat"', 'material = "body"'),
        ({"objects[0].transform.rotate": [0, 10, 0]}, "transform = {rotate = [0, 10, 0]}", 'material = "body"'),
        ({"film.exposure": -1}, "exposure = -1", "size = [64, 32] # small"),
    ],
)
def test_a_new_key_follows_the_last_key_of_its_table(values: dict[str, Any], line: str, after: str, scene: Path) -> None:
    write(scene, values, digest(scene))
    lines = scene.read_text().splitlines()
    assert lines[lines.index(after) + 1] == line
    lines.remove(line)
    assert lines == SCENE.splitlines()


def test_what_is_written_is_what_the_page_showed(scene: Path) -> None:
    values = {
        "camera.fov": 30,
        "quality.fresnel": "schlick",
        "materials.gold.roughness": 0.4,
        "objects.0.material": "gold",
        "materials.body": {"brdf": "ggx"},
        "materials.body.roughness": 0.2,
    }
    wanted = load(scene, values)
    write(scene, values, digest(scene))
    assert load(scene) == wanted
    for comment in ("# A scene.", "# in words", "# small", "# of the ball", "# The ball.", "# round", "# the sun"):
        assert comment in scene.read_text()


def test_a_file_that_has_changed_meanwhile_is_left_alone(scene: Path) -> None:
    before = digest(scene)
    scene.write_text(SCENE + "# Edited.\n")
    with pytest.raises(Changed, match="has changed"):
        write(scene, {"film.exposure": 1}, before)
    assert scene.read_text() == SCENE + "# Edited.\n"


@pytest.mark.parametrize(
    "values", [{"film.exposure": 1000}, {"materials.body.nonsense": 1}, {"objects.5.shading": "flat"}, {"a b": 1}, {"film": 3}]
)
def test_values_that_no_scene_can_have_are_refused(values: dict[str, Any], scene: Path) -> None:
    with pytest.raises(SceneError):
        write(scene, values, digest(scene))
    assert scene.read_text() == SCENE


def test_only_toml_is_written(tmp_path: Path) -> None:
    path = tmp_path / "scene.json"
    path.write_text("{}")
    with pytest.raises(SceneError, match="TOML"):
        write(path, {"film.exposure": 1}, digest(path))


def test_links_line_endings_and_the_mode_of_the_file_stay(scene: Path) -> None:
    scene.write_bytes(b"\xef\xbb\xbf" + SCENE.replace("\n", "\r\n").encode())
    scene.chmod(0o640)
    link = scene.with_name("link.toml")
    link.symlink_to(scene.name)
    write(link, {"film.exposure": 1.5, "lights.0.intensity": 3}, digest(scene))
    data = scene.read_bytes()
    assert link.is_symlink()
    assert data.startswith(b"\xef\xbb\xbf# A scene.\r\n")
    assert b"intensity = 3\r\n" in data
    assert os.stat(scene).st_mode & 0o777 == 0o640
    assert load(scene).film.exposure == 1.5
