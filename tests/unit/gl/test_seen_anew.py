"""Pictures of a scene whose camera alone has changed: they are the bytes that a renderer without any cache draws."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import glshade.gl.renderer as module
from glshade.gl.renderer import Renderer
from glshade.scene.scene import Scene

AT = {"eye": (0, 2, 9), "target": (0, 0, 0)}
# The eye of this camera lies in the cube at the origin, which its near plane cuts open.
INSIDE = {"eye": (0.2, 0.1, 0.3), "target": (0, 0, -3), "near": 0.5, "far": 50}


def scene(**changes: Any) -> Scene:
    """Returns a scene with objects of several programs, one of them large enough for the culling of clusters."""
    objects = [
        {"name": "cube", "shape": "cube", "material": {"brdf": "phong", "kd": (0.2, 0.5, 0.8)}},
        {"shape": "sphere", "material": "gold", "transform": {"translate": (2.5, 0, 0)}},
        {"shape": "torus", "material": {"brdf": "lambert", "unlit": True}, "transform": {"translate": (-2.5, 0, 0)}},
        {"shape": "cube", "parent": "cube", "transform": {"translate": (0, 3, -2), "scale": (-1, 1, 1)}},
    ]
    values: dict[str, Any] = {"objects": objects, "camera": AT, "film": {"size": (64, 48), "samples": 4}, **changes}
    return Scene(**values)


def through(scene: Scene, **camera: Any) -> Scene:
    """Returns the scene through another camera. It shares all other values."""
    return scene.through(Scene(objects=scene.objects, materials=scene.materials, camera=camera).camera)


@pytest.fixture(scope="module")
def renderer() -> Iterator[Renderer]:
    with Renderer() as opened:
        yield opened


CAMERAS: dict[str, dict[str, Any]] = {
    "moved": {"eye": (3, 1, 7), "target": (0, 0, 0)},
    "fitted": {"fit": True, "eye": (1, 1, 1)},
    "inside": INSIDE,
    "orthographic": {"type": "orthographic", "eye": (0, 2, 9), "target": (0, 0, 0), "height": 8},
    "far": {"eye": (0, 0, 1e14), "target": (0, 0, 0), "near": 1e10, "far": 1e15},
}
SCENES: dict[str, dict[str, Any]] = {
    "default lights": {},
    "own lights": {
        "lights": ({"type": "point", "position": (3, 4, 5), "intensity": 30.0}, {"type": "ambient", "intensity": 0.2})
    },
    "pages": {"lights": tuple({"type": "point", "position": (n, 4, 5), "intensity": 2.0} for n in range(40))},
    "glass": {
        "objects": (
            {"shape": "cube", "material": {"brdf": "lambert", "alpha_mode": "blend", "alpha": 0.5}},
            {"shape": "sphere", "transform": {"translate": (0, 0, -3)}},
        )
    },
}


@pytest.mark.filterwarnings("ignore::glshade.gl.preparation.ApproximateWarning")
@pytest.mark.parametrize("lit", SCENES)
def test_a_moved_camera_gives_the_bytes_of_a_fresh_preparation(
    renderer: Renderer, lit: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = scene(**SCENES[lit])
    for name, camera in CAMERAS.items():
        for dtype in ("uint8", "float32") if name == "moved" else ("float32",):
            with monkeypatch.context() as patched:
                patched.setattr(module, "seen_anew", lambda before, scene: None)
                expected = renderer.render(through(first, **camera), dtype=dtype).pixels
            renderer.render(first, dtype=dtype)
            found = renderer.render(through(first, **camera), dtype=dtype).pixels
            np.testing.assert_array_equal(found, expected, err_msg=f"{name}, {dtype}")
            assert name == "far" or expected.std() > 0


def test_only_the_first_picture_is_assembled(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    first = scene()
    renderer.render(first)
    monkeypatch.setattr(module, "ready", lambda *arguments: pytest.fail("the scene was assembled again"))
    pictures = [renderer.render(through(first, eye=(x, 2, 9), target=(0, 0, 0))).pixels for x in range(3)]
    assert not np.array_equal(pictures[0], pictures[1])


def test_another_material_is_prepared_anew(renderer: Renderer) -> None:
    first = scene()
    before = renderer.render(first).pixels
    changed = first.model_copy(
        update={"objects": (first.objects[0].model_copy(update={"material": "gold"}), *first.objects[1:])}
    )
    assert not first.differs_in_camera(changed)
    assert not np.array_equal(renderer.render(changed).pixels, before)
