"""The page about data sets: its scenes are scenes, and it names every format of cameras and every layer of a PNG file."""

from __future__ import annotations

import re
from pathlib import Path

import glshade as g
from glshade.calibration.formats import FORMATS
from glshade.image.layer_paths import PNG_AOVS

PAGE = (Path(g.__file__).parent.parent / "docs" / "data-sets.md").read_text(encoding="utf-8")
# What the tables of the page vary.
REST = """
[materials.body]
brdf = "ggx"
[[lights]]
name = "sun"
type = "directional"
[[objects]]
name = "thing"
mesh = "mug.obj"
material = "body"
"""
TRIANGLE = {"mug.obj": "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"}
BOWL = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
3 0 1 2
"""


def test_the_tables_of_the_page_make_a_scene(tmp_path: Path) -> None:
    camera, sample = re.findall(r"^```toml\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)
    for name, text in {**TRIANGLE, "bowl.ply": BOWL, "s.toml": camera + REST, "t.toml": sample + REST}.items():
        (tmp_path / name).write_text(text)
    assert g.load(tmp_path / "s.toml").film.size == (640, 480)
    from glshade.scene.file import SceneFile

    file = SceneFile(tmp_path / "t.toml")
    drawn = file.drawn(7)
    assert set(drawn) >= {"materials.body.roughness", "lights.sun.intensity", "objects.thing.mesh", "camera.eye"}
    assert file.scene(7, None).objects[0].mesh is not None


def test_every_format_and_every_layer_is_told() -> None:
    for name in [*FORMATS, *PNG_AOVS]:
        assert f"`{name}`" in PAGE, name
