"""Cameras: the matrices of their views, and that a camera that frames the scene sees all of it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from support.strategies import fitted_cameras, transforms

from glshade import Orthographic, Perspective, Scene
from glshade.radiance.readying import ready
from glshade.scene.camera import CAMERAS, View, window

CUBE = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
ASPECTS = st.sampled_from([0.01, 0.5, 1.0, 16 / 9, 100.0])


def project(view: View, points: Any, zero_to_one: bool = True) -> Any:
    """Returns x, y and depth of points in clip space, after the division by w (N, 3). Points in the picture have x and y in
    [-1, 1] and depth in [0, 1]."""
    clip = np.c_[np.asarray(points) - view.eye, np.ones(len(points))] @ view.clip_from_world(zero_to_one).T
    return clip[:, :3] / clip[:, 3:]


def check_framed(view: View, points: Any) -> None:
    """Checks that all points lie inside the picture, and between the near and the far plane."""
    seen = project(view, points)
    assert np.all(np.isfinite(seen))
    assert np.all(np.abs(seen[:, :2]) <= 1), "outside of the picture"
    # The tolerance covers float64 rounding at the planes.
    assert np.all((seen[:, 2] >= -1e-9) & (seen[:, 2] <= 1 + 1e-9)), "before the near or behind the far plane"


@given(
    camera=fitted_cameras(),
    aspect=ASPECTS,
    points=hnp.arrays(np.float64, st.tuples(st.integers(1, 20), st.just(3)), elements=st.floats(-100, 100, width=32)),
)
def test_a_fitted_camera_sees_every_point(camera: dict[str, Any], aspect: float, points: Any) -> None:
    check_framed(CAMERAS[camera["type"]].model_validate(camera).view(points, aspect), points)  # type: ignore[attr-defined]


@given(camera=fitted_cameras(), transform=transforms(), parent=transforms())
def test_a_fitted_camera_sees_every_vertex_of_a_scene(camera: Any, transform: Any, parent: Any) -> None:
    objects = [
        {"name": "a", "shape": "torus", "transform": parent},
        {"shape": {"type": "icosphere", "subdivisions": 1}, "parent": "a", "transform": transform},
    ]
    assembly = ready(Scene(objects=objects, camera=camera, film={"size": (160, 90)}))
    for instance in assembly.instances:
        world = instance.mesh.positions @ instance.world_from_object[:3, :3].T + instance.world_from_object[:3, 3]
        check_framed(assembly.view, world.astype(np.float64))


# A calibrated camera whose axis meets the picture beside its middle.
OFF_CENTRE = {"fx": 120, "fy": 100, "cx": 70, "cy": 40, "width": 150, "height": 100}


def _camera(kind: str) -> Any:
    return CAMERAS[kind](**(OFF_CENTRE if kind == "intrinsics" else {}))


@pytest.mark.parametrize("kind", CAMERAS)
@pytest.mark.parametrize("aspect", [0.5, 1.0, 2.0])
def test_a_fitted_picture_is_filled(kind: str, aspect: float) -> None:
    """The scene is not only framed but also near: it reaches within 10 % of an edge."""
    view = _camera(kind).view(CUBE, aspect)  # type: ignore[attr-defined]
    assert np.abs(project(view, CUBE)[:, :2]).max() > 0.9


@pytest.mark.parametrize("kind", CAMERAS)
@pytest.mark.parametrize("size", [1e-12, 1.0, 1e12])
def test_scenes_of_any_size_are_framed(kind: str, size: float) -> None:
    points = size * (CUBE + np.array([1000, 0, 0]))
    check_framed(_camera(kind).view(points, 1.5), points)  # type: ignore[attr-defined]


@pytest.mark.parametrize("kind", CAMERAS)
def test_a_single_point_is_seen(kind: str) -> None:
    point = np.array([[3.0, 4.0, 5.0]])
    check_framed(_camera(kind).view(point, 1.0), point)  # type: ignore[attr-defined]


def test_positions_in_a_perspective_picture() -> None:
    view = Perspective(eye=(0, 0, 5), target=(0, 0, 0), fov=90).view(CUBE, 2.0)
    # At depth 5 the picture spans 10 in height and 20 in width; y points down, so that row 0 is the top.
    seen = project(view, [[0, 0, 0], [10, 0, 0], [0, 5, 0], [-10, -5, 0]])
    assert seen[:, :2] == pytest.approx(np.array([[0, 0], [1, 0], [0, -1], [-1, 1]]), abs=1e-12)


def test_positions_in_an_orthographic_picture() -> None:
    view = Orthographic(eye=(0, 0, 5), target=(0, 0, 0), height=4).view(CUBE, 2.0)
    seen = project(view, [[4, 2, 1], [-4, -2, -1]])
    assert seen[:, :2] == pytest.approx(np.array([[1, -1], [-1, 1]]), abs=1e-12)
    assert view.toward_viewer == pytest.approx([0, 0, 1])


def test_depth_is_reversed() -> None:
    for kind in (Perspective, Orthographic):
        view = kind(eye=(0, 0, 5), target=(0, 0, 0), near=1, far=9).view(CUBE, 1.0)
        for zero_to_one, farthest in ((True, 0), (False, -1)):
            near, middle, far = project(view, [[0, 0, 4], [0, 0, 0], [0, 0, -4]], zero_to_one)[:, 2]
            assert (near, far) == pytest.approx((1, farthest), abs=1e-12)
            assert near > middle > far


def test_a_matrix_replaces_eye_target_and_up() -> None:
    matrix = [[0, 0, 1, 7], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1]]
    by_matrix = Perspective(matrix=matrix).view(CUBE, 1.0)
    by_eye = Perspective(eye=(7, 0, 0), target=(0, 0, 0)).view(CUBE, 1.0)
    assert by_matrix.clip_from_world() == pytest.approx(by_eye.clip_from_world())
    assert by_matrix.eye == pytest.approx(by_eye.eye)


@pytest.mark.parametrize("up", [(0, 1, 0), (0, -1, 0), (0, 1e-30, 0), (1e20, 1e20, 0)])
def test_looking_along_up_still_gives_axes(up: Any) -> None:
    axes = Perspective(eye=(0, 5, 0), target=(0, 0, 0), up=up).axes(np.zeros(3))
    assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1)
    assert axes[2] == pytest.approx([0, 1, 0])


def test_fit_keeps_the_direction() -> None:
    view = Perspective(eye=(0, 0, -1), target=(0, 0, 0), fit=True).view(CUBE + np.array([50, 0, 0]), 1.0)
    assert view.axes[2] == pytest.approx([0, 0, -1])
    assert view.eye[:2] == pytest.approx([50, 0])
    check_framed(view, CUBE + np.array([50, 0, 0]))


def test_planes_that_are_given_are_kept() -> None:
    view = Perspective(eye=(0, 0, 5), near=0.5, far=100).view(CUBE, 1.0)
    assert (view.near, view.far) == (0.5, 100)
    beyond = Perspective(eye=(0, 0, 5), near=50).view(CUBE, 1.0)
    assert beyond.near == 50 < beyond.far


@given(
    x=st.integers(0, 90),
    y=st.integers(0, 40),
    point=st.tuples(*[st.floats(-1, 1)] * 3),
)
def test_a_window_shows_its_part(x: int, y: int, point: Any) -> None:
    """A point has the same pixel coordinates in the window as in the whole picture, less the window's corner."""
    size, part = (100, 50), (10, 10)
    whole = Perspective(eye=(0, 0, 5), target=(0, 0, 0)).view(CUBE, 2.0)

    def pixel(clip: Any, size: tuple[int, int]) -> Any:
        p = clip @ np.array([*(np.array(point) - whole.eye), 1])
        return (p[:2] / p[3] + 1) / 2 * size

    clip = whole.clip_from_world()
    assert pixel(window(clip, size, x, y, *part), part) == pytest.approx(pixel(clip, size) - [x, y], abs=1e-9)


def test_fov_is_vertical() -> None:
    view = Perspective(fov=60).view(CUBE, 3.0)
    assert view.half_height == pytest.approx(math.tan(math.radians(30)))
    assert view.half_width == pytest.approx(3 * view.half_height)
