"""Points on the GPU: OpenGL's points, one vertex each, give the picture of squares of two triangles each."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray

from glshade import Renderer, Scene
from glshade.assembly.strokes import Squares
from glshade.gl import vertices as uploading
from glshade.gl.preparation import ApproximateWarning
from glshade.mesh.mesh import Mesh
from glshade.mesh.strokes import build_strokes
from glshade.verification.verification import verify

RNG = np.random.default_rng(3)
COUNT = 400
PLACES = RNG.normal(size=(COUNT, 3)) * 2
COLOURS = np.column_stack([RNG.uniform(0.1, 1, (COUNT, 3)), np.ones(COUNT)])
NUMBERS = np.arange(COUNT)
LIGHT = {"type": "point", "position": (1, 2, 3), "intensity": 9.0}


def cloud(normals: Any = None, order: Any = NUMBERS) -> Mesh:
    return build_strokes(PLACES, np.stack([order, order], axis=1), normals, None, COLOURS)[0]


def scene(mesh: Mesh, **film: Any) -> Scene:
    """Returns a scene in which some squares lie at the borders of the picture, and some points behind the camera."""
    camera = {"eye": (0.5, 0, 3), "target": (0, 0, 0), "fov": 50}
    tables = {"objects": [{"mesh": mesh}], "camera": camera, "lights": [LIGHT], "film": {"size": (64, 48), **film}}
    return Scene.model_validate(tables)


def drawn(renderer: Renderer, shown: Scene) -> tuple[NDArray[Any], bool, bool]:
    """Returns (picture, whether OpenGL's points drew it, whether the squares were made)."""
    pixels = renderer.render(shown, dtype="float32").pixels.copy()
    assert renderer.last_prepared is not None
    (call,) = renderer.last_prepared.calls
    mesh = call.instance.mesh
    assert isinstance(mesh, Squares)
    return pixels, call.vertices.mode == moderngl.POINTS, "_made" in vars(mesh)


@pytest.mark.parametrize("normals", [None, PLACES, 0 * PLACES])
@pytest.mark.parametrize(("side", "samples"), [(1.0, 1), (5.0, 1), (1.0, 4), (2.5, 4), (9.0, 4)])
def test_points_are_the_squares(renderer: Any, monkeypatch: Any, normals: Any, side: float, samples: int) -> None:
    film = {"point_size": side, "samples": samples}
    mesh = cloud()
    if normals is not None:
        mesh = replace(mesh, normals=normals.astype(np.float32))
    by_points, are_points, were_made = drawn(renderer, scene(mesh, **film))
    assert are_points
    assert not were_made
    monkeypatch.setattr(uploading, "are_squares", lambda *_: False)
    by_triangles, are_points, were_made = drawn(renderer, scene(replace(mesh), **film))
    assert not are_points
    assert were_made
    assert np.unique(by_points.reshape(-1, 3), axis=0).shape[0] > 20
    np.testing.assert_array_equal(by_points, by_triangles)


def test_squares_between_the_pixels_that_are_no_squares_are_triangles(renderer: Any) -> None:
    _, are_points, were_made = drawn(renderer, scene(cloud(), point_size=2.5))
    assert not are_points
    assert were_made


def test_a_point_that_is_listed_twice_or_in_another_order_is_drawn(renderer: Any) -> None:
    """Vertices that no point uses are dropped; of two points at one place, the first one is visible."""
    picture, are_points, _ = drawn(renderer, scene(cloud(order=np.append(NUMBERS[::-1], 7)), point_size=3))
    assert are_points
    np.testing.assert_array_equal(picture, drawn(renderer, scene(cloud(), point_size=3))[0])
    assert picture.any()


def test_a_new_view_uploads_places_and_no_colours(monkeypatch: Any) -> None:
    sizes: list[int] = []
    with Renderer() as own:
        mesh = cloud()
        own.render(scene(mesh))
        plain = own.context.gl.buffer

        def counted(data: Any = None, **more: Any) -> Any:
            sizes.append(0 if data is None else memoryview(data).nbytes)
            return plain(data, **more)

        monkeypatch.setattr(own.context.gl, "buffer", counted)
        moved = scene(mesh).model_copy(update={"camera": scene(mesh).camera.model_copy(update={"eye": (0.0, 1.0, 3.0)})})
        own.render(moved)
    assert sum(sizes) == 12 * COUNT


def test_points_are_verified() -> None:
    assert not verify(scene(cloud(), point_size=3, samples=4)).unexplained
    assert not verify(scene(cloud(PLACES), point_size=2)).unexplained


def test_blended_points_are_sorted_as_triangles(renderer: Any) -> None:
    glass = {"brdf": "lambert", "kd": 1.0, "alpha": 0.5, "alpha_mode": "blend"}
    blended = Scene.model_validate({**dict(scene(cloud(), point_size=4)), "objects": [{"mesh": cloud(), "material": glass}]})
    with pytest.warns(ApproximateWarning):
        _, are_points, _ = drawn(renderer, blended)
    assert not are_points


def test_a_picture_as_wide_as_the_driver_allows(renderer: Renderer) -> None:
    """A viewport cannot be larger than that, so that the points are drawn as triangles."""
    side = renderer.context.largest_side
    wide = scene(cloud(), size=(side, 3), point_size=3)
    whole = renderer.render(wide, tile=side).pixels.copy()
    assert whole.any()
    np.testing.assert_array_equal(whole, renderer.render(wide, tile=side // 2).pixels)
