"""Winding: meshes whose triangles are wound against their normals, in both renderers, and the warning of their files."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glshade import Scene
from glshade.assembly.assembly import assemble
from glshade.mesh import primitives
from glshade.mesh.file import load
from glshade.mesh.mesh import Mesh
from glshade.mesh.winding import against_normals, turned_over
from glshade.reference.picture import render
from glshade.verification.verification import verify

Array = np.ndarray[Any, Any]
BALL = primitives.sphere(16, 8)
assert BALL.normals is not None
OUTWARD, INWARD = BALL.triangles, BALL.triangles[:, ::-1]
# An eye outside of the ball, and one at its middle.
OUTSIDE = {"eye": (0, 0, 4), "target": (0, 0, 0)}
INSIDE = {"eye": (0, 0, 0), "target": (0, 0, 1)}


def scene(triangles: Array, sign: float = 1.0, camera: Any = OUTSIDE, **more: Any) -> Scene:
    """Returns the scene of a ball with these triangles, whose normals point outward times `sign`."""
    assert BALL.normals is not None
    mesh = Mesh.build(BALL.positions, triangles, normals=sign * BALL.normals)
    ball = {"mesh": mesh, **more}
    return Scene.model_validate({"objects": [ball], "camera": camera, "film": {"size": (48, 48)}})


def picture(one: Scene) -> Array:
    return np.asarray(render(one).pixels)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("triangles", [OUTWARD, INWARD], ids=["outward", "inward"])
def test_a_ball_looks_right_whatever_its_winding_and_normals(renderer: Any, triangles: Array, sign: float) -> None:
    """The default lights come from the viewer's side, so a normal on the wrong side would leave the ball dark."""
    one = scene(triangles, sign)
    np.testing.assert_allclose(picture(one), picture(scene(OUTWARD)), atol=1e-4)
    assert verify(one, renderer=renderer).verdict == "verified"


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("triangles", [OUTWARD, INWARD], ids=["outward", "inward"])
def test_a_room_looks_right_from_inside(triangles: Array, sign: float) -> None:
    right = picture(scene(INWARD, -1.0, INSIDE, sides="both"))
    np.testing.assert_allclose(picture(scene(triangles, sign, INSIDE)), right, atol=1e-4)


def test_front_and_both_go_by_the_winding_alone() -> None:
    """As the glTF specification demands: an inward-wound hull shows its inside only."""
    front = assemble(scene(INWARD, sides="front")).instances[0]
    both = assemble(scene(INWARD, sides="both")).instances[0]
    assert not front.back_faces
    assert both.back_faces
    for instance in (front, both):
        assert against_normals(instance.mesh).all()
    by_material = assemble(scene(INWARD, material={"brdf": "lambert", "sides": "front"})).instances[0]
    assert against_normals(by_material.mesh).all()


def test_a_turned_ball_is_culled_again() -> None:
    assert not assemble(scene(INWARD)).instances[0].back_faces


@given(seed=st.integers(0, 1000), share=st.floats(0, 1))
def test_exactly_the_triangles_against_their_normals_are_turned_over(seed: int, share: float) -> None:
    chosen = np.random.default_rng(seed).random(len(OUTWARD)) < share
    triangles = np.where(chosen[:, None], INWARD, OUTWARD)
    mesh = Mesh.build(BALL.positions, triangles, normals=BALL.normals)
    np.testing.assert_array_equal(against_normals(mesh), chosen)
    turned = turned_over(mesh)
    assert turned.is_solid
    assert (turned is mesh) == (not chosen.any())
    assert turned_over(mesh) is turned


def test_a_sliver_of_a_closed_mesh_is_left_alone() -> None:
    """The tip of a dent has the normals of its neighbours: the mesh is closed, and its winding is right."""
    normals = np.array(BALL.normals)
    normals[BALL.triangles[40]] *= -1
    mesh = Mesh.build(BALL.positions, OUTWARD, normals=normals)
    assert against_normals(mesh).any()
    assert turned_over(mesh) is mesh


def test_a_mesh_without_normals_has_no_triangle_against_them() -> None:
    mesh = Mesh.build(BALL.positions, INWARD)
    assert not against_normals(mesh).any()
    assert turned_over(mesh) is mesh


def ply(path: Path, triangles: Array) -> Path:
    """Writes the ball as a PLY file with normals."""
    head = f"ply\nformat ascii 1.0\nelement vertex {len(BALL.positions)}\n"
    head += "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
    head += f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    rows = [" ".join(map(str, row)) for row in np.hstack([BALL.positions, BALL.normals]).tolist()]
    path.write_text(head + "\n".join([*rows, *(f"3 {a} {b} {c}" for a, b, c in triangles)]) + "\n")
    return path


@pytest.mark.parametrize(("wrong", "share"), [(1.0, "100 %"), (0.25, "25 %")])
def test_a_file_wound_against_its_normals_gets_one_warning_with_the_share(tmp_path: Path, wrong: float, share: str) -> None:
    count = int(wrong * len(OUTWARD))
    path = ply(tmp_path / "ball.ply", np.vstack([INWARD[:count], OUTWARD[count:]]))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        load(path)
    assert len(caught) == 1
    assert str(caught[0].message).startswith(
        f"{path}: {count} of {len(OUTWARD)} triangles ({share}) are wound against their normals; "
    )


def test_a_file_wound_as_its_normals_say_gets_no_warning(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        load(ply(tmp_path / "ball.ply", OUTWARD))
