"""render_many: the pictures of many cameras are those that `render` gives one by one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import glshade
from glshade import Renderer

CAMERAS = {
    "side": {"eye": (4, 1, 0)},
    "above": {"eye": (0, 5, 0.1), "fov": 30},
    "flat": {"type": "orthographic", "eye": (1, 1, 3)},
    "calibrated": {"type": "intrinsics", "fx": 50, "fy": 60, "cx": 20, "cy": 18, "width": 48, "height": 36, "fit": True},
}


def _scene(**film: Any) -> glshade.Scene:
    return glshade.Scene(
        objects=[{"shape": "torus", "material": "gold"}, {"shape": "sphere", "transform": {"translate": (1.4, 0, 0)}}],
        film={"size": (48, 36), **film},
        cameras=CAMERAS,
    )


@pytest.mark.parametrize("film", [{}, {"samples": 4}, {"supersample": 2, "crop": (5, 4, 30, 20)}, {"background": (0, 0, 0, 0)}])
@pytest.mark.parametrize("dtype", ["uint8", "float32"])
def test_the_same_bytes_as_one_by_one(film: dict[str, Any], dtype: Any, renderer: Renderer) -> None:
    scene = _scene(**film)
    pictures = renderer.render_many(scene, [*CAMERAS, scene.camera], dtype=dtype)
    single = [renderer.render(scene.through(camera), dtype=dtype).pixels for camera in (*scene.cameras.values(), scene.camera)]
    assert pictures.dtype == dtype
    assert np.array_equal(pictures, np.stack(single))
    assert len({picture.tobytes() for picture in pictures}) == len(pictures)


def test_faults(renderer: Renderer) -> None:
    scene = _scene()
    with pytest.raises(ValueError, match="no cameras"):
        renderer.render_many(scene, [])
    with pytest.raises(KeyError):
        renderer.render_many(scene, ["nobody"])
    free = scene.model_copy(update={"film": glshade.Film()})
    with pytest.raises(ValueError, match="another size"):
        renderer.render_many(free, ["side", "calibrated"])
