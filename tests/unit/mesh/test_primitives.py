"""The built-in shapes: closed, wound outward, of the stated size, with analytic normals."""

from __future__ import annotations

import inspect
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glshade.mesh import primitives
from glshade.mesh.geometry import face_normals
from glshade.mesh.mesh import Mesh
from glshade.mesh.primitives import PRIMITIVES

CLOSED = sorted(set(PRIMITIVES) - {"plane"})


def euler(mesh: Mesh) -> int:
    """V - E + F, vertices counted by position."""
    _, place = np.unique(mesh.positions, axis=0, return_inverse=True)
    t = place.reshape(-1)[mesh.triangles]
    edges = np.sort(np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]]), axis=1)
    return int(place.max() + 1 - len(np.unique(edges, axis=0)) + len(t))


def volume(mesh: Mesh) -> float:
    p = mesh.positions.astype(float)[mesh.triangles]
    return float(np.einsum("ij,ij->", p[:, 0], np.cross(p[:, 1], p[:, 2])) / 6)


@pytest.mark.parametrize("name", sorted(PRIMITIVES))
def test_every_shape_has_sensible_defaults(name: str) -> None:
    mesh = PRIMITIVES[name]()
    parameters = inspect.signature(PRIMITIVES[name]).parameters.values()
    assert all(p.default is not p.empty for p in parameters)
    assert mesh.normals is not None
    assert (mesh.uvs is None) == (name == "icosphere")
    if mesh.uvs is not None:
        assert mesh.uvs.min() >= 0
        assert mesh.uvs.max() <= 1 + 1e-6
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-6)
    middle = mesh.normals[mesh.triangles].astype(float).mean(axis=1)
    assert np.einsum("ij,ij->i", middle, face_normals(mesh)).min() > 0.99, "normals and winding agree"


@pytest.mark.parametrize("name", CLOSED)
def test_closed_shapes_are_solid(name: str) -> None:
    mesh = PRIMITIVES[name]()
    assert mesh.is_solid
    assert euler(mesh) == (0 if name == "torus" else 2)


@pytest.mark.parametrize(
    ("name", "size"),
    [
        ("sphere", (1, 1, 1)),
        ("icosphere", (1, 1, 1)),
        ("cube", (1, 1, 1)),
        ("plane", (1, 0, 1)),
        ("torus", (1.4, 0.4, 1.4)),
        ("cylinder", (1, 1, 1)),
        ("cone", (1, 1, 1)),
    ],
)
def test_sizes(name: str, size: tuple[float, float, float]) -> None:
    np.testing.assert_allclose(PRIMITIVES[name]().bounds, np.outer([-1, 1], size), atol=2e-3)


@given(st.integers(3, 40), st.integers(2, 20))
@settings(max_examples=25, deadline=None)
def test_any_sphere_is_solid_with_its_corners_on_it(segments: int, rings: int) -> None:
    mesh = primitives.sphere(segments, rings)
    assert mesh.is_solid
    assert len(mesh.triangles) == 2 * segments * (rings - 1)
    np.testing.assert_allclose(np.linalg.norm(mesh.positions, axis=1), 1, atol=1e-6)
    assert mesh.normals is not None
    np.testing.assert_array_equal(mesh.normals, mesh.positions)


@given(st.integers(3, 40), st.integers(3, 20), st.floats(0.05, 1))
@settings(max_examples=25, deadline=None)
def test_any_torus_is_closed(segments: int, sides: int, minor: float) -> None:
    mesh = primitives.torus(segments, sides, minor)
    assert volume(mesh) > 0
    if minor < 0.95:  # nearer 1 its inner ring shrinks to one point
        assert mesh.is_solid
        assert euler(mesh) == 0


@given(st.integers(3, 100))
@settings(max_examples=25, deadline=None)
def test_any_cylinder_and_cone_is_solid(segments: int) -> None:
    polygon = segments / 2 * math.sin(2 * math.pi / segments)
    for shape, content in ((primitives.cylinder, 2 * polygon), (primitives.cone, 2 * polygon / 3)):
        mesh = shape(segments)
        assert mesh.is_solid
        assert volume(mesh) == pytest.approx(content, rel=1e-5)


def test_the_icosphere_converges_to_the_sphere() -> None:
    exact = 4 * math.pi / 3
    errors = []
    for subdivisions in range(6):
        mesh = primitives.icosphere(subdivisions)
        assert len(mesh.triangles) == 20 * 4**subdivisions
        errors.append(exact - volume(mesh))
    ratios = np.divide(errors[:-1], errors[1:])
    np.testing.assert_allclose(ratios[2:], 4, rtol=0.05, err_msg="second order")


def test_the_poles_of_the_sphere_lie_on_y_and_v_runs_from_south_to_north() -> None:
    mesh = primitives.sphere(16, 8)
    assert mesh.uvs is not None
    north, south = mesh.uvs[mesh.positions[:, 1] == 1], mesh.uvs[mesh.positions[:, 1] == -1]
    assert len(north) == len(south) == 16, "one copy a triangle"
    np.testing.assert_array_equal(north[:, 1], 1)
    np.testing.assert_array_equal(south[:, 1], 0)
    front = mesh.positions[:, 2].argmax()
    np.testing.assert_allclose(mesh.uvs[front], [0.5, 0.5], atol=1e-6)


def test_the_cube_has_sharp_edges() -> None:
    mesh = primitives.cube()
    assert len(mesh.positions) == 24
    assert mesh.normals is not None
    assert (np.count_nonzero(mesh.normals, axis=1) == 1).all()


def test_rims_are_sharp_and_walls_are_smooth() -> None:
    mesh = primitives.cylinder(8)
    assert mesh.normals is not None
    cap = np.abs(mesh.normals[:, 1]) == 1
    wall = mesh.normals[:, 1] == 0
    assert (cap | wall).all()
    assert cap.sum() == 18
    assert wall.sum() == 18


def test_the_plane_faces_up_in_as_many_segments_as_asked() -> None:
    mesh = primitives.plane(5)
    assert len(mesh.triangles) == 50
    np.testing.assert_allclose(face_normals(mesh), [[0, 1, 0]] * 50, atol=1e-12)


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("sphere", {"segments": 2}),
        ("sphere", {"rings": 1}),
        ("icosphere", {"subdivisions": -1}),
        ("plane", {"segments": 0}),
        ("torus", {"minor": 0.0}),
        ("cone", {"segments": 2}),
    ],
)
def test_impossible_parameters_are_refused_by_name(name: str, arguments: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=f"{name}: {next(iter(arguments))} must"):
        PRIMITIVES[name](**arguments)
