"""Edges: which edges of a mesh without normals are sharp: by their angles, by smoothing groups, and at the borders of parts."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glshade.errors import AssetError
from glshade.mesh.checking import Faults
from glshade.mesh.geometry import face_normals
from glshade.mesh.mesh import Mesh
from glshade.mesh.normals import with_normals
from glshade.mesh.surface import build_surface
from glshade.scene.object import Object

Array = np.ndarray[Any, Any]
# The threshold of an object that says nothing.
DEFAULT = Object.model_fields["threshold"].default


def prism(sides: int) -> tuple[Array, Array]:
    """Returns the positions and triangles of the walls of a prism, without its caps, that share their corners."""
    angle = np.arange(sides) * 2 * np.pi / sides
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    positions = np.vstack([np.column_stack([ring, np.full(sides, z)]) for z in (0.0, 1.0)])
    here = np.arange(sides)
    there = np.roll(here, -1)
    quads = [np.stack([here, there, there + sides], axis=1), np.stack([here, there + sides, here + sides], axis=1)]
    return positions, np.vstack(quads)


def turned(seed: int) -> Array:
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return np.asarray(q * np.sign(np.linalg.det(q)))


def corner_normals(mesh: Mesh) -> Array:
    """Returns the normals (T, 3, 3) of the corners of each triangle."""
    assert mesh.normals is not None
    return mesh.normals[mesh.triangles].astype(float)


def is_flat(mesh: Mesh) -> bool:
    """Returns whether the corners of each triangle have the normal of the face."""
    return bool(np.abs(corner_normals(mesh) - face_normals(mesh)[:, None]).max() < 1e-3)


@pytest.mark.parametrize(
    ("sides", "sharp"), [(4, True), (6, True), (8, True), (9, True), (10, False), (12, False), (36, False)]
)
def test_a_hexagonal_prism_is_no_cylinder(sides: int, sharp: bool) -> None:
    mesh = with_normals(Mesh.build(*prism(sides)), "auto", DEFAULT)
    assert is_flat(mesh) == sharp


def test_a_chamfer_of_45_degrees_leaves_the_plate_flat() -> None:
    profile = np.array([[0, 0], [2, 0], [2.2, -0.2], [2.2, -1.0]])
    positions = np.vstack([np.column_stack([profile, np.full(4, z)]) for z in (0.0, 1.0)])
    triangles = [t for k in range(3) for t in ([k, k + 4, k + 5], [k, k + 5, k + 1])]
    assert is_flat(with_normals(Mesh.build(positions, triangles), "auto", DEFAULT))


def test_a_countersink_of_six_sides_is_sharp() -> None:
    """The faces of an inscribed cone bend less than the cone: 40.9 degrees in place of 45 at the rim of six sides."""
    angle = np.arange(6) * np.pi / 3
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    positions = np.vstack([np.column_stack([r * ring, np.full(6, z)]) for r, z in ((1, 0), (0.7, -0.3), (2, 0))])
    here, there = np.arange(6), np.roll(np.arange(6), -1)
    cone = np.vstack([np.stack([here, there, there + 6], 1), np.stack([here, there + 6, here + 6], 1)])
    plate = np.vstack([np.stack([here + 12, there + 12, there], 1), np.stack([here + 12, there, here], 1)])
    mesh = with_normals(Mesh.build(positions, np.vstack([plate, cone])[:, ::-1]), "auto", DEFAULT)
    plate_normals = corner_normals(mesh)[:12]
    np.testing.assert_allclose(np.abs(plate_normals[..., 2]), 1, atol=1e-6)


@given(sides=st.integers(4, 24), seed=st.integers(0, 1000), exponent=st.floats(-6, 6))
def test_an_edge_at_the_threshold_is_sharp_whatever_the_rounding(sides: int, seed: int, exponent: float) -> None:
    positions, triangles = prism(sides)
    # Six digits, as many programs write them.
    written = [[float(f"{x:.6g}") for x in row] for row in positions @ turned(seed).T * 10.0**exponent]
    mesh = Mesh.build(written, triangles)
    assert is_flat(with_normals(mesh, "smooth", 360 / sides))
    assert not is_flat(with_normals(mesh, "smooth", 360 / sides + 0.1))


def test_at_180_degrees_no_edge_is_sharp_and_at_0_every_bent_edge_is() -> None:
    mesh = Mesh.build(*prism(3))
    assert len(with_normals(mesh, "smooth", 180).positions) == 6
    assert is_flat(with_normals(mesh, "smooth", 0))
    assert len(with_normals(mesh, "smooth", 0).positions) == 12, "the diagonal of a quad does not bend"


# A roof of four triangles whose ridge bends by 90 degrees, and its two sides.
ROOF = [[0, 0, 1], [1, 0, 1], [0, -1, 0], [1, -1, 0], [0, 1, 0], [1, 1, 0]]
LEFT, RIGHT = [[0, 2, 3], [0, 3, 1]], [[0, 1, 5], [0, 5, 4]]


@pytest.mark.parametrize(
    ("smoothing", "vertices"), [([7, 7, 7, 7], 6), ([1, 1, 2, 2], 8), ([0, 0, 0, 0], 12), ([1, 1, 0, 0], 10), ([1, 1, 1, 2], 8)]
)
def test_smoothing_groups_alone_say_which_edges_are_sharp(smoothing: list[int], vertices: int) -> None:
    mesh = Mesh.build(ROOF, LEFT + RIGHT, smoothing=smoothing)
    assert mesh.normals is not None
    assert len(mesh.positions) == vertices
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-6)
    assert with_normals(mesh, "auto", 0) is mesh, "the file's own normals, at any threshold"


def test_smoothing_groups_keep_the_uvs_of_a_seam() -> None:
    uvs = np.arange(16).reshape(8, 2) / 16
    seam = [*ROOF, ROOF[0], ROOF[1]]
    mesh = Mesh.build(seam, [*LEFT, [6, 7, 5], [6, 5, 4]], uvs=uvs, smoothing=[1, 1, 1, 1])
    assert mesh.uvs is not None
    assert mesh.normals is not None
    assert len(mesh.positions) == 8
    np.testing.assert_allclose(mesh.uvs[mesh.triangles][2:], uvs[[[6, 7, 5], [6, 5, 4]]], atol=1e-7)
    at_ridge = mesh.normals[(mesh.positions == ROOF[0]).all(axis=1)]
    assert len(at_ridge) == 2
    np.testing.assert_allclose(at_ridge[0], at_ridge[1], atol=1e-6)


def test_given_normals_win_over_smoothing_groups() -> None:
    mesh = Mesh.build(ROOF, LEFT + RIGHT, normals=[[0, 0, 1]] * 6, smoothing=[0, 0, 0, 0])
    assert mesh.normals is not None
    np.testing.assert_array_equal(mesh.normals, [[0, 0, 1]] * 6)


@pytest.mark.parametrize("smoothing", [[1, 1, 1], [[1], [1], [1], [1]], [0.5, 1, 1, 1]])
def test_smoothing_groups_of_a_wrong_shape_are_refused(smoothing: Any) -> None:
    with pytest.raises(AssetError, match=r"mesh smoothing is .* not integers of shape"):
        Mesh.build(ROOF, LEFT + RIGHT, smoothing=smoothing)


def parts_of(positions: Array, triangles: Array, part: Array, **more: Array) -> list[dict[str, Any]]:
    """Returns the arguments of `build_surface` for the parts, each with only the vertices that it uses."""
    result = []
    for number in range(part.max() + 1):
        used, corners = np.unique(triangles[part == number], return_inverse=True)
        own = {name: values[part == number] for name, values in more.items()}
        result.append({"positions": positions[used], "triangles": corners.reshape(-1, 3), **own})
    return result


@given(seed=st.integers(0, 1000), count=st.integers(1, 6), far=st.sampled_from([0.0, 5e5]), grouped=st.booleans())
def test_normals_run_across_the_borders_of_parts(seed: int, count: int, far: float, grouped: bool) -> None:
    """A bumpy ball in random parts has the same normals as in one piece."""
    rng = np.random.default_rng(seed)
    positions, triangles = prism(10)
    positions = positions * (1 + 0.2 * rng.random((20, 1))) + far
    part = rng.integers(0, count, len(triangles))
    part[:count] = np.arange(count)
    more = {"smoothing": rng.integers(0, 3, len(triangles))} if grouped else {}
    whole = with_normals(Mesh.build(positions, triangles, **more), "auto", DEFAULT)
    meshes = build_surface(parts_of(positions, triangles, part, **more), Faults())
    for number, mesh in enumerate(meshes):
        assert mesh is not None
        smooth = with_normals(mesh, "auto", DEFAULT)
        assert smooth.neighbours is None, "normals were their only purpose"
        np.testing.assert_allclose(corner_normals(smooth), corner_normals(whole)[part == number], atol=1e-6)
        np.testing.assert_allclose(
            mesh.positions[mesh.triangles] + mesh.origin, positions[triangles[part == number]], atol=1e-5
        )
        np.testing.assert_array_equal(mesh.origin, whole.origin)
        bounds = positions[triangles[part == number]].reshape(-1, 3)
        np.testing.assert_allclose(mesh.bounds, [bounds.min(axis=0), bounds.max(axis=0)], rtol=1e-6)


def test_a_part_of_which_nothing_is_left_is_none() -> None:
    good = {"positions": np.eye(3), "triangles": [[0, 1, 2]]}
    lost = {"positions": np.full((3, 3), np.nan), "triangles": [[0, 1, 2]]}
    faults = Faults()
    meshes = build_surface([lost, good], faults)
    assert meshes[0] is None
    assert meshes[1] is not None
    assert (faults.not_finite, faults.triangles) == (1, 2)
    with pytest.raises(AssetError, match="none of its 2 triangles"):
        build_surface([lost, lost], Faults())


def test_many_parts_at_one_place_take_little_time_and_memory() -> None:
    """A fan of 3,000 triangles, each a part of its own, would have 9 million pairs of neighbours at its apex."""
    angle = np.arange(3001) * 2 * np.pi / 3001
    rim = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    parts = [{"positions": np.array([[0, 0, 1], rim[k], rim[k + 1]]), "triangles": np.array([[0, 1, 2]])} for k in range(3000)]
    meshes = build_surface(parts, Faults())
    assert max(len(mesh.neighbours) for mesh in meshes if mesh is not None and mesh.neighbours is not None) <= 2
