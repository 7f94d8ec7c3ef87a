"""The OffscreenRenderer with cameras, lights and meshes of users' scripts, tested on pyrender's own objects."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from glshade import GlshadeError, SceneError
from glshade.errors import AssetWarning
from glshade.pyrender import OffscreenRenderer, RenderFlags

pyrender = pytest.importorskip("pyrender", reason="the extra pyrender is not installed")


class Own(pyrender.Camera):  # type: ignore[misc,name-defined]
    """A camera with the projection matrix (4, 4) that it is given."""

    def __init__(self, matrix: Any) -> None:
        super().__init__(znear=0.05, zfar=100.0)
        self.matrix = np.array(matrix, dtype=float)

    def get_projection_matrix(self, width: Any = None, height: Any = None) -> Any:
        return self.matrix


WEAK = np.diag([0.5, 0.5, -1.0, 1.0])
SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=np.float32)
FACES = np.array([[0, 1, 2], [0, 2, 3]])


def scene(camera: Any, pose: Any = None, positions: Any = SQUARE) -> Any:
    """Returns a scene with the square from (0, 0) to (1, 1), seen along -z."""
    made = pyrender.Scene()
    made.add(pyrender.Mesh([pyrender.Primitive(positions=positions, indices=FACES, normals=np.tile([0.0, 0, 1], (4, 1)))]))
    made.add(camera, pose=np.eye(4) if pose is None else pose)
    return made


def covered(depth: Any) -> list[int]:
    """Returns the first and last row, and the first and last column, in which something is drawn."""
    rows, columns = np.nonzero(depth)
    return [int(v) for v in (rows.min(), rows.max(), columns.min(), columns.max())]


@pytest.fixture(scope="module")
def door() -> Any:
    made = OffscreenRenderer(40, 40)
    yield made
    made.delete()


def test_a_weak_perspective_camera_is_drawn_where_its_matrix_says(door: Any) -> None:
    _, depth = door.render(scene(Own(WEAK)))
    assert covered(depth) == [10, 19, 20, 29]
    # pyrender converts the depth 0 of clip space as that of a perspective camera.
    assert depth[15, 25] == pytest.approx(2 * 0.05 * 100 / 100.05, rel=1e-5)


def test_a_flipped_and_off_centre_matrix_is_drawn(door: Any) -> None:
    matrix = WEAK @ np.diag([1, -1, 1, 1])
    matrix[:2, 3] = -0.5, 0.25
    assert covered(door.render(scene(Own(matrix)))[1]) == [15, 24, 10, 19]


def test_a_sheared_matrix_is_one_line(door: Any) -> None:
    matrix = WEAK.copy()
    matrix[0, 1] = 0.3
    with pytest.raises(SceneError, match="sheared") as caught:
        door.render(scene(Own(matrix)))
    assert "\n" not in str(caught.value)


def test_a_scaled_pose_is_drawn_with_a_warning(door: Any) -> None:
    pose = np.diag([2.0, 2.0, 2.0, 1.0])
    pose[2, 3] = 4
    with pytest.warns(AssetWarning, match="its inverse is used"):
        _, depth = door.render(scene(pyrender.PerspectiveCamera(np.pi / 2, aspectRatio=1.0), pose))
    # The distance is 4 scene units, which are 2 units of the camera.
    assert depth[18, 21] == pytest.approx(2, rel=1e-4)


def test_faces_and_normals(door: Any) -> None:
    made = scene(Own(WEAK))
    triangle, surface, surfaces = door.faces(made)
    assert covered(surface + 1) == [10, 19, 20, 29]
    assert triangle[18, 28] == 0
    assert triangle[11, 21] == 1
    assert triangle[0, 0] == -1
    assert surfaces == [(next(iter(made.mesh_nodes)), 0, 0)]
    assert door.normals(made)[15, 25] == pytest.approx([0, 0, 1], abs=1e-6)
    assert not door.normals(made)[0, 0].any()


def test_faces_and_normals_show_back_faces_when_asked(door: Any) -> None:
    """Scripts that sample open meshes draw depth with SKIP_CULL_FACES, and the normals have to cover the same pixels."""
    made = pyrender.Scene()
    turned = pyrender.Primitive(positions=SQUARE, indices=FACES[:, ::-1], normals=np.tile([0.0, 0, -1], (4, 1)))
    made.add(pyrender.Mesh([turned]))
    made.add(Own(WEAK))
    assert not door.normals(made).any()
    assert (door.faces(made)[1] == -1).all()
    drawn = door.render(made, RenderFlags.DEPTH_ONLY | RenderFlags.SKIP_CULL_FACES) > 0
    normals = door.normals(made, RenderFlags.SKIP_CULL_FACES)
    assert covered(drawn) == covered(normals.any(axis=2)) == [10, 19, 20, 29]
    np.testing.assert_allclose(normals[drawn], np.tile([0.0, 0, 1], (100, 1)), atol=1e-6)
    triangle, surface, _ = door.faces(made, RenderFlags.SKIP_CULL_FACES)
    assert covered(surface + 1) == [10, 19, 20, 29]
    assert (triangle[18, 28], triangle[11, 21]) == (0, 1)


def test_triangles_that_are_not_finite_are_counted(door: Any) -> None:
    broken = SQUARE.copy()
    broken[3, 0] = np.nan
    with pytest.warns(AssetWarning, match="1 triangles with a corner that is not finite"):
        _, depth = door.render(scene(Own(WEAK), positions=broken))
    assert depth[18, 28] > 0
    assert depth[11, 21] == 0


def test_the_error_about_shaders_names_the_calls(door: Any) -> None:
    with pytest.raises(GlshadeError, match=r"normals\(scene\)"):
        door._renderer._program_cache = None


def test_more_than_four_lights_are_brighter_or_limited() -> None:
    made = scene(Own(WEAK))
    for _ in range(4):
        made.add(pyrender.DirectionalLight(intensity=0.5), pose=np.eye(4))
    limited = OffscreenRenderer(40, 40, most_lights=4)
    four = limited.render(made)[0]
    made.add(pyrender.DirectionalLight(intensity=0.5), pose=np.eye(4))
    made.add(pyrender.DirectionalLight(intensity=0.5), pose=np.eye(4))
    np.testing.assert_array_equal(limited.render(made)[0], four)
    limited.delete()
    every = OffscreenRenderer(40, 40, samples=1)
    with pytest.warns(AssetWarning, match="brighter than pyrender"):
        brighter = every.render(made)[0]
    every.delete()
    assert brighter[15, 25, 0] > four[15, 25, 0]
