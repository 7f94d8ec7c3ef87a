"""Points and lines of mesh files, from the file to the picture."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glshade
from glshade.image.file import read as read_picture
from glshade.image.srgb import srgb_to_linear
from glshade.scene.camera import CAMERAS

# Three points in a plane that faces the viewer, and their colours [codes].
PLACES = np.array([(0, 0, 0), (6, 0, 0), (0, 6, 0)], dtype=np.float32)
CODES = np.array([(255, 0, 0), (0, 200, 0), (40, 80, 255)])
COLOURS = srgb_to_linear(CODES / 255)


def ply(edges: Any = ()) -> bytes:
    lines = ["ply", "format ascii 1.0", "element vertex 3", *(f"property float {axis}" for axis in "xyz")]
    lines += [f"property uchar {name}" for name in ("red", "green", "blue")]
    lines += [f"element edge {len(edges)}", "property int vertex1", "property int vertex2"] if edges else []
    rows = [[*place, *code] for place, code in zip(PLACES.astype(int), CODES, strict=True)]
    lines += ["end_header", *(" ".join(map(str, row)) for row in [*rows, *edges])]
    return "\n".join([*lines, ""]).encode()


def off() -> bytes:
    rows = [" ".join(map(str, [*place, *code])) for place, code in zip(PLACES.astype(int), CODES, strict=True)]
    return "\n".join(["COFF", "3 0 0", *rows, ""]).encode()


def obj(elements: str) -> bytes:
    rows = ["v " + " ".join(map(str, [*place, *code / 255])) for place, code in zip(PLACES.astype(int), CODES, strict=True)]
    return "\n".join([*rows, elements, ""]).encode()


def gltf(mode: int) -> bytes:
    data = PLACES.tobytes() + COLOURS.astype(np.float32).tobytes()
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    accessor = {"componentType": 5126, "count": 3, "type": "VEC3"}
    return json.dumps(
        {
            "asset": {"version": "2.0"},
            "buffers": [{"uri": uri, "byteLength": len(data)}],
            "bufferViews": [{"buffer": 0, "byteOffset": 36 * k, "byteLength": 36} for k in range(2)],
            "accessors": [
                {**accessor, "bufferView": 0, "min": PLACES.min(axis=0).tolist(), "max": PLACES.max(axis=0).tolist()},
                {**accessor, "bufferView": 1},
            ],
            "meshes": [{"primitives": [{"mode": mode, "attributes": {"POSITION": 0, "COLOR_0": 1}}]}],
            "nodes": [{"mesh": 0}],
            "scenes": [{"nodes": [0]}],
        }
    ).encode()


FILES: dict[str, Callable[[], bytes]] = {
    "points.ply": ply,
    "points.off": off,
    "points.obj": lambda: obj("p 1 2 3"),
    "points.gltf": lambda: gltf(0),
    "lines.ply": lambda: ply([(0, 1), (0, 2)]),
    "lines.obj": lambda: obj("l 2 1 3"),
    "lines.gltf": lambda: gltf(1),
    "loop.gltf": lambda: gltf(2),
    "strip.gltf": lambda: gltf(3),
}
# The vertices that the lines of each file join. The other files hold points.
LINES: dict[str, list[tuple[int, int]]] = {
    "lines.ply": [(0, 1), (0, 2)],
    "lines.obj": [(1, 0), (0, 2)],
    "lines.gltf": [(0, 1)],
    "loop.gltf": [(0, 1), (1, 2), (2, 0)],
    "strip.gltf": [(0, 1), (1, 2)],
}


@pytest.fixture(params=sorted(FILES))
def path(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    file = tmp_path / request.param
    file.write_bytes(FILES[request.param]())
    return file


def test_points_and_lines_of_files_are_drawn_in_their_colours(renderer: Any, path: Path) -> None:
    """The file alone is drawn, under the default lights, which must not change the colours."""
    scene = glshade.load(path, {"film.samples": 1, "film.background": (0, 0, 0), "film.size": (64, 64), "film.point_size": 4})
    # A scene unit is 8 pixels, and (3, 3) is in the middle of the picture.
    camera = CAMERAS["orthographic"].model_validate({"eye": (3, 3, 9), "target": (3, 3, 0), "height": 8.0})
    picture = renderer.render(scene.model_copy(update={"camera": camera}), dtype="float32").pixels[::-1].copy()
    ends = (PLACES[:, :2] + 1) * 8
    centres = np.stack(np.meshgrid(np.arange(64) + 0.5, np.arange(64) + 0.5), axis=-1)
    inside, outside = np.zeros((64, 64), bool), np.ones((64, 64), bool)
    for start, stop in LINES.get(path.name, [(k, k) for k in range(3)]):
        length = np.linalg.norm(ends[stop] - ends[start])
        along = (ends[stop] - ends[start]) / length if length else np.array([1.0, 0.0])
        room = 0 if length else 2  # a point is a square, which reaches as far along as across
        far, aside = (centres - ends[start]) @ along, np.abs((centres - ends[start]) @ (-along[1], along[0]))
        inside |= (far > 0.05 - room) & (far < length + room - 0.05) & (aside < 1.95)
        outside &= (far < -0.05 - room) | (far > length + room + 0.05) | (aside > 2.05)
    drawn = (picture > 0).any(axis=2)
    assert drawn[inside].all()
    assert not drawn[outside].any()
    for place, colour in zip(ends.astype(int), COLOURS, strict=True):
        around = picture[place[1] - 2 : place[1] + 2, place[0] - 2 : place[0] + 2, :3].reshape(-1, 3)
        # The colours of a line blend from end to end.
        assert not around.any() or np.abs(around - colour).max(axis=1).min() < (0.06 if path.name in LINES else 1e-5)


def test_a_file_of_points_becomes_a_picture_and_a_verdict(glshade: Any, tmp_path: Path) -> None:
    (tmp_path / "cloud.ply").write_bytes(ply())
    for size in ("2", "9"):
        done = glshade(
            "render", tmp_path / "cloud.ply", "-o", tmp_path / f"{size}.png", "--size", "64x64", "--point-size", size
        )
        assert done.returncode == 0, done.stderr
    pictures = [read_picture(tmp_path / f"{size}.png")[0] for size in ("2", "9")]
    small, large = ((p != p[0, 0]).any(axis=2).sum() for p in pictures)
    assert 3 * 4 <= small <= 3 * 9
    assert 3 * 60 <= large <= 3 * 100
    done = glshade("verify", tmp_path / "cloud.ply", "--size", "64x64", "--point-size", "3")
    assert done.returncode == 0, done.stdout
    assert "verified" in done.stdout
    assert "film.samples = 4" in done.stdout
    refused = glshade("render", tmp_path / "cloud.ply", "-o", tmp_path / "no.png", "--point-size", "0")
    assert refused.returncode == 2
    assert "--point-size" in refused.stderr
    assert not (tmp_path / "no.png").exists()
