"""Points and lines in meshes: their arrays are checked, and the cache keeps them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glshade import Scene
from glshade.errors import AssetError
from glshade.mesh.entries import keep, recall
from glshade.mesh.mesh import Mesh
from glshade.mesh.reading.contents import Contents
from glshade.mesh.reading.file import MeshFile
from glshade.mesh.strokes import build_strokes, segments
from glshade.scene.digest import scene_digest

THREE = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])


def strokes_of(mesh: Mesh) -> Any:
    assert mesh.strokes is not None
    return mesh.strokes.tolist()


@pytest.mark.parametrize(
    ("mode", "expected"),
    [
        ("lines", [[5, 6], [7, 8]]),
        ("strip", [[5, 6], [6, 7], [7, 8], [8, 9]]),
        ("loop", [[5, 6], [6, 7], [7, 8], [8, 9], [9, 5]]),
    ],
)
def test_segments_are_those_of_opengl(mode: Any, expected: Any) -> None:
    assert segments([5, 6, 7, 8, 9], mode).tolist() == expected
    assert segments([], mode).tolist() == []


def test_vertices_that_nothing_uses_are_dropped_with_their_attributes() -> None:
    positions = [(np.nan, 0, 0), *THREE, (1e30, 0, 0)]
    colours = np.linspace(0, 1, 20).reshape(5, 4)
    mesh, lost = build_strokes(positions, [(1, 3), (2, 2)], colours=colours, uvs=colours[:, :2])
    assert lost == 0
    assert np.array_equal(mesh.positions, THREE)
    assert strokes_of(mesh) == [[0, 2], [1, 1]]
    assert np.array_equal(mesh.colours, colours[1:4].astype(np.float32))
    assert np.array_equal(mesh.uvs, colours[1:4, :2].astype(np.float32))
    assert mesh.triangles.shape == (0, 3)


def test_points_without_a_finite_position_are_left_out_with_a_warning() -> None:
    file = MeshFile(Path("cloud.ply"), Path(), b"")
    mesh = file.build_points("", [*THREE, (np.nan, 0, 0), (0, np.inf, 0)])
    assert strokes_of(mesh) == [[0, 0], [1, 1], [2, 2]]
    assert file.contents.warnings == [
        "cloud.ply: 2 points or lines have positions that are not finite numbers; drawn without them"
    ]


def test_a_normal_of_zero_is_no_normal() -> None:
    """COLMAP and CloudCompare write normals of zero where they have none."""
    points = [[0, 0], [1, 1], [2, 2]]
    assert build_strokes(THREE, points, np.zeros((3, 3)))[0].normals is None
    given = build_strokes(THREE, points, [(0, 0, 0), (0, 0, 5), (np.nan, 0, 1)])[0].normals
    assert given is not None
    assert given.tolist() == [[0, 0, 0], [0, 0, 1], [0, 0, 0]]


def test_a_mesh_far_from_the_origin_keeps_its_digits() -> None:
    far = THREE * 1e-3 + (5e5, 5.4e6, 0)
    mesh = build_strokes(far, [[0, 1], [1, 2]])[0]
    assert mesh.positions + mesh.origin == pytest.approx(far, abs=1e-9)
    assert mesh.bounds == pytest.approx(np.stack([far.min(axis=0), far.max(axis=0)]), abs=1e-9)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"strokes": [[0, 3]]}, "index 3 of a point or line is out of range: the mesh has 3 vertices"),
        ({"strokes": [[-1, 0]]}, "index -1 of a point or line is out of range"),
        ({"strokes": np.zeros((0, 2), int)}, "mesh has no points or lines"),
        ({"strokes": [[0.5, 1.0]]}, "not integers of shape"),
        ({"colours": np.ones((2, 4))}, "mesh has 3 positions and 2 colours"),
        ({"positions": np.full((3, 3), np.nan)}, "has no point or line whose positions are finite numbers"),
        ({"positions": [(0, 0, 0), (1e300, 0, 0), (0, 0, 0)]}, "too large for float32"),
    ],
)
def test_wrong_arrays_are_refused(changes: Any, message: str) -> None:
    arguments = {"positions": THREE, "strokes": [[0, 1], [2, 2]], **changes}
    with pytest.raises(AssetError, match=message):
        build_strokes(**arguments)


def test_the_cache_keeps_points_and_lines(tmp_path: Path) -> None:
    contents = Contents()
    mesh = build_strokes(THREE, [[0, 1], [2, 2]], colours=np.ones((3, 4)))[0]
    contents.add("strokes", mesh)
    kept = recall(keep(contents, tmp_path / "entry"))
    assert kept is not None
    assert kept.meshes[0].digest == mesh.digest
    assert strokes_of(kept.meshes[0]) == [[0, 1], [2, 2]]


def test_the_digest_of_a_scene_tells_points_from_lines() -> None:
    digests = {
        scene_digest(Scene.model_validate({"objects": [{"mesh": build_strokes(THREE, strokes)[0]}]}))
        for strokes in ([[0, 0], [1, 1], [2, 2]], [[0, 1], [1, 2], [2, 0]], [[0, 1], [1, 2], [0, 2]])
    }
    assert len(digests) == 3
