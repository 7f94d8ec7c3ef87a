"""Culling: clusters of triangles that turn their backs to the viewer are left out from the second picture of a mesh on."""

from __future__ import annotations

from typing import Any

import numpy as np

from glshade import Scene
from glshade.assembly.assembly import assemble
from glshade.assembly.culling import WORTHWHILE, facing
from glshade.mesh import primitives
from glshade.mesh.mesh import Mesh


def test_a_mesh_is_drawn_whole_once_and_its_back_is_left_out_later(renderer: Any) -> None:
    ball = primitives.icosphere(5)
    assert len(ball.triangles) > WORTHWHILE
    mesh = Mesh.build(ball.positions, ball.triangles)
    tables = {"objects": [{"mesh": mesh}], "camera": {"eye": (0, 0, 4), "target": (0, 0, 0)}, "film": {"size": (64, 64)}}
    assembly = assemble(Scene.model_validate(tables))
    (instance,) = assembly.instances
    assert facing(instance, assembly.view) is None
    visible = facing(instance, assembly.view)
    assert visible is not None
    assert len(visible) < 0.7 * len(ball.triangles)
    first, later = (renderer.render(Scene.model_validate(tables)).pixels.copy() for _ in range(2))
    np.testing.assert_array_equal(first, later)


def test_each_new_mesh_is_drawn_whole() -> None:
    ball = primitives.icosphere(5)
    for number in range(3):
        mesh = Mesh.build(ball.positions * (1 + number), ball.triangles)
        assembly = assemble(Scene.model_validate({"objects": [{"mesh": mesh}], "camera": {"eye": (0, 0, 9)}}))
        assert facing(assembly.instances[0], assembly.view) is None
