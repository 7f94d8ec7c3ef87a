"""The covered box: pixels that only show the background are not drawn, and the picture is the same."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glshade import Renderer, Scene
from glshade.gl import renderer as drawing
from glshade.gl.background import covered

LIGHTS = [{"type": "directional", "direction": (0, -1, -1)}, {"type": "ambient", "intensity": 0.3}]
PERSPECTIVE = {"eye": (0, 0, 5), "target": (0, 0, 0), "fov": 40}
ORTHOGRAPHIC = {"type": "orthographic", "eye": (0, 0, 5), "target": (0, 0, 0), "height": 4.0}
OFF_AXIS = {"type": "intrinsics", "fx": 200, "fy": 190, "cx": 30, "cy": 100, "width": 160, "height": 120, "eye": (0, 0, 5)}


def scene(places: Any, camera: Any, **film: Any) -> Scene:
    """Returns a scene of small balls at places (N, 3)."""
    objects = [{"shape": {"type": "icosphere", "subdivisions": 2}, "transform": {"scale": 0.2, "translate": p}} for p in places]
    film = {"size": (160, 120), "samples": 4, "background": (0.3, 0.1, 0.5), **film}
    return Scene.model_validate({"objects": objects, "camera": camera, "lights": LIGHTS, "film": film})


def pictures(renderer: Renderer, shown: Scene, dtype: Any) -> tuple[Any, int, Any]:
    """Returns (the picture, the number of boxes that were less than the picture, the picture that is drawn whole)."""
    found: list[Any] = []

    def watched(*arguments: Any) -> Any:
        found.append(covered(*arguments))
        return found[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(drawing, "covered", watched)
        picture = renderer.render(shown, dtype=dtype).pixels.copy()
        patch.setattr(drawing, "covered", lambda *_: None)
        whole = renderer.render(shown, dtype=dtype).pixels.copy()
    return picture, sum(box is not None for box in found), whole


@pytest.mark.parametrize("camera", [PERSPECTIVE, ORTHOGRAPHIC, OFF_AXIS])
@pytest.mark.parametrize("dtype", ["uint8", "float32"])
@pytest.mark.parametrize(
    "film", [{}, {"samples": 1, "supersample": 2}, {"crop": (10, 5, 140, 112)}, {"background": (0.2, 0.4, 0.1, 0.5)}]
)
def test_the_background_need_not_be_drawn(renderer: Any, camera: Any, dtype: str, film: Any) -> None:
    for places in ([(-1.2, 1.0, 0.0)], [(0.9, -1.1, 0.5)], [(9.0, 0.0, 0.0)], [(0.0, 0.0, 0.0), (0.5, 0.4, 0.0)]):
        picture, fewer, whole = pictures(renderer, scene(places, camera, **film), dtype)
        assert fewer == 1
        np.testing.assert_array_equal(picture, whole)


@given(
    st.lists(st.tuples(*[st.floats(-3, 3)] * 2, st.floats(-20, 4.5)), min_size=1, max_size=3),
    st.sampled_from([PERSPECTIVE, ORTHOGRAPHIC, OFF_AXIS]),
)
@settings(max_examples=40, deadline=None)
def test_every_pixel_that_shows_an_object_is_in_the_box(renderer: Any, places: Any, camera: Any) -> None:
    picture, _, whole = pictures(renderer, scene(places, camera), "uint8")
    np.testing.assert_array_equal(picture, whole)


def test_an_object_behind_the_near_plane_has_no_box(renderer: Any) -> None:
    shown = scene([(0.0, 0.0, 4.95)], {**PERSPECTIVE, "near": 0.1})
    picture, fewer, whole = pictures(renderer, shown, "uint8")
    assert fewer == 0
    np.testing.assert_array_equal(picture, whole)
