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


GLASS = {"brdf": "lambert", "kd": (0.2, 0.6, 0.4), "alpha_mode": "blend", "alpha": 0.5}
LAMPS = [{"type": "point", "position": (3.0, n / 100, 4.0), "intensity": 0.05} for n in range(300)]


@pytest.mark.filterwarnings("ignore::glshade.gl.preparation.ApproximateWarning")
@pytest.mark.parametrize("changes", [{"material": GLASS}, {"lights": LAMPS}, {"shading": "gouraud"}], ids=str)
def test_scenes_that_need_more_than_a_new_view(changes: dict[str, Any], renderer: Renderer) -> None:
    """Blended surfaces are sorted for each camera, and pages of lights are added in linear light."""
    lights = changes.pop("lights", None)
    scene = glshade.Scene(
        objects=[{"shape": "torus", **changes}, {"shape": "cube", "transform": {"translate": (0, 0, -2)}}],
        film={"size": (32, 24)},
        lights=lights,
        cameras={name: CAMERAS[name] for name in ("side", "above")},
    )
    pictures = renderer.render_many(scene, scene.cameras)
    single = [renderer.render(scene.through(camera)).pixels for camera in scene.cameras.values()]
    assert np.array_equal(pictures, np.stack(single))
    assert pictures.std() > 0


@pytest.mark.parametrize("dtype", ["uint8", "float32"])
def test_pictures_are_read_in_several_parts_where_memory_is_short(
    dtype: Any, renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = _scene(samples=4)
    names = [*CAMERAS] * 3
    expected = renderer.render_many(scene, names, dtype=dtype)
    collected: list[int] = []
    collect = Renderer._collect

    def counted(self: Renderer, drawn: Any, pictures: Any) -> None:
        collected.append(len(drawn))
        collect(self, drawn, pictures)

    monkeypatch.setattr(Renderer, "_collect", counted)
    for limit, parts in ((0, [1] * 12 + [0]), (1 << 30, [12])):
        collected.clear()
        monkeypatch.setattr("glshade.gl.renderer.TOGETHER", limit)
        assert np.array_equal(renderer.render_many(scene, names, dtype=dtype), expected)
        assert collected == parts


def test_faults(renderer: Renderer) -> None:
    scene = _scene()
    with pytest.raises(ValueError, match="no cameras"):
        renderer.render_many(scene, [])
    with pytest.raises(ValueError, match="'int8' is none of"):
        renderer.render_many(scene, ["side"], dtype="int8")  # type: ignore[arg-type]
    with pytest.raises(KeyError):
        renderer.render_many(scene, ["nobody"])
    free = scene.model_copy(update={"film": glshade.Film()})
    with pytest.raises(ValueError, match="another size"):
        renderer.render_many(free, ["side", "calibrated"])
