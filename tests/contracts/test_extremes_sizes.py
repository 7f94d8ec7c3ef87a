"""Property: objects of any size, far from the origin, scaled, flattened or mirrored are drawn as the reference allows."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.judge import BALL, CAMERA, SUN, judge_all, scene

from glshade import Mesh, Renderer
from glshade.mesh.primitives import icosphere

# Interior pixels, relative to max(1, |c|). Measured: 5.4e-6.
WORST = 5e-5
# Measured 5.3e-5: the facets of a flattened sphere are seen edge on, where normals turn fast.
FLATTENED = 2e-4
MESH = icosphere(2)


def lamp(at: Any, size: float = 1.0) -> dict[str, Any]:
    """Returns a point light beside an object of this size at this place."""
    position = tuple(float(c) for c in np.asarray(at) + size * np.array([2.0, 3.0, 4.0]))
    return {"type": "point", "position": position, "falloff": "none"}


@pytest.mark.parametrize("light", ["sun", "lamp"])
@pytest.mark.parametrize("size", [1e-15, 1e-6, 1e6, 1e15])
def test_of_any_size(size: float, light: str, renderer: Renderer) -> None:
    """The transform scales a sphere, and a mesh has the size itself."""
    shining = SUN if light == "sun" else lamp((0, 0, 0), size)
    for made in (
        {**BALL, "transform": {"scale": size}},
        {"mesh": Mesh.build(MESH.positions * np.float64(size), MESH.triangles)},
    ):
        drawn, worst = judge_all(lambda m, made=made: scene({**made, "material": m}, [shining]), renderer)
        assert drawn > 500
        assert worst <= WORST


@pytest.mark.parametrize("size", [1e3, 1e4])
def test_a_ground_much_larger_than_the_view(size: float, renderer: Renderer) -> None:
    """A float32 position that is interpolated over a triangle has an error of 6e-8 of the triangle's size. So v turns by this
    error divided by the viewer's distance, 3.

    llvmpipe clips in float32, too: at 1e6 the edge between two triangles moves by a pixel, and from 1e7 on parts are lost.
    """
    ground = {"shape": "plane", "transform": {"translate": (0, -1, 0), "scale": size}}
    camera = {**CAMERA, "near": 0.1, "far": 1e9}
    slack = 2**-24 * size / 3
    drawn, worst = judge_all(lambda m: scene({**ground, "material": m}, [SUN], camera=camera), renderer, slack)
    assert drawn > 1000
    assert worst <= WORST + slack


@pytest.mark.parametrize("size", [1e-20, 1e20])
def test_of_a_size_whose_square_float32_cannot_hold(size: float, renderer: Renderer) -> None:
    ball = {**BALL, "transform": {"scale": size}}
    drawn, worst = judge_all(lambda m: scene({**ball, "material": m}, [lamp((0, 0, 0), size)]), renderer)
    assert drawn > 1000
    assert worst <= WORST


@pytest.mark.parametrize("distance", [1e4, 1e7])
def test_far_from_the_origin(distance: float, renderer: Renderer) -> None:
    """The transform moves a sphere, and a mesh has large coordinates itself."""
    at = np.array([distance, -distance, distance])
    moved = {**BALL, "transform": {"translate": tuple(at)}}
    made = {"mesh": Mesh.build(MESH.positions + at, MESH.triangles)}
    for item in (moved, made):
        drawn, worst = judge_all(lambda m, item=item: scene({**item, "material": m}, [lamp(at)]), renderer)
        assert drawn > 500
        assert worst <= WORST


SCALES = [(1, 1, -1), (-1, -1, -1), (-1, 1, 1), (1, 1e-3, 1), (1, 1e-20, 1), (1, 1e3, 1), (1, -1e-3, 1)]


@pytest.mark.parametrize("scale", SCALES, ids=str)
def test_scaled(scale: tuple[float, float, float], renderer: Renderer) -> None:
    item = {**BALL, "transform": {"scale": scale, "rotate": (20, 30, 40)}}
    drawn, worst = judge_all(lambda m: scene({**item, "material": m}, [SUN, lamp((0, 0, 0), 2 * max(scale))]), renderer)
    assert drawn > 0
    assert not worst > FLATTENED


def test_scaled_by_1e_20_and_back(renderer: Renderer) -> None:
    """The matrix for normals is right for a tiny transform, and for one whose parent undoes it."""
    parent = {"name": "parent", **BALL, "transform": {"scale": 1e20}, "sides": "front"}
    child = {"name": "child", **BALL, "parent": "parent", "transform": {"scale": 1e-20, "rotate": (20, 30, 40)}}
    camera = {**CAMERA, "near": 1.0, "far": 100.0}
    plain = {**BALL, "transform": {"rotate": (20, 30, 40)}}
    for rate in ("phong", "gouraud", "flat"):
        both, one = (
            renderer.render(scene(items, [SUN], camera=camera), dtype="float32", shading=rate).pixels.copy()  # type: ignore[arg-type]
            for items in ([parent, child], [plain])
        )
        assert np.isfinite(both).all()
        assert np.abs(both - one).max() <= 1e-6


@pytest.mark.parametrize("axis", range(3))
def test_a_mirrored_object_is_lit_from_its_own_side(axis: int, renderer: Renderer) -> None:
    """A sphere is its own mirror image, so winding and normals must come out unchanged."""
    scale = [1.0, 1.0, 1.0]
    scale[axis] = -1.0
    for sides in ("front", "both"):
        for material in ({"brdf": "lambert"}, {"brdf": "ashikhmin_shirley", "pu": 10.0, "pv": 10.0}):
            item = {"shape": {"type": "sphere"}, "material": material, "sides": sides}
            plain, mirrored = (
                renderer.render(scene({**item, "transform": t}, [SUN], camera=CAMERA), dtype="float32").pixels.copy()
                for t in ({}, {"scale": scale})
            )
            assert plain.max() > 0.1
            # In the mirror image, quads are cut into triangles along the other diagonal, so the surface differs by as much as
            # the facets differ from the sphere.
            assert np.median(np.abs(mirrored - plain)) <= 1e-3
            assert np.percentile(np.abs(mirrored - plain), 99) <= 0.05
