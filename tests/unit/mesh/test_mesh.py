"""Normals, tangents and order: the laws of lecture slides 55-59, in the units a user would check them in."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glshade.errors import AssetError
from glshade.mesh import primitives
from glshade.mesh.facets import faceted
from glshade.mesh.frames import brushed
from glshade.mesh.geometry import face_normals
from glshade.mesh.mesh import Mesh
from glshade.mesh.normals import with_normals
from glshade.mesh.order import in_local_order
from glshade.mesh.tangents import with_tangents
from glshade.mesh.welding import weld

Array = np.ndarray[Any, Any]

# A cube by its 8 shared corners.
CUBE_POSITIONS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
CUBE_QUADS = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
CUBE_TRIANGLES = np.array([t for a, b, c, d in CUBE_QUADS for t in ([a, b, c], [a, c, d])])


def shared_cube() -> Mesh:
    return Mesh.build(CUBE_POSITIONS, CUBE_TRIANGLES)


def rotation(seed: int) -> Array:
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return np.asarray(q * np.sign(np.linalg.det(q)))


def corner_sets(mesh: Mesh) -> Array:
    """Returns each triangle as its corners' coordinates, in an order that does not depend on the mesh's."""
    p = mesh.positions[mesh.triangles].reshape(len(mesh.triangles), 9)
    return p[np.lexsort(p.T)]


rigid = st.tuples(st.integers(0, 10_000), st.floats(-10, 10))


@given(rigid)
@settings(max_examples=60, deadline=None)
def test_face_normals_are_unit_and_right_handed_at_any_scale(move: tuple[int, float]) -> None:
    seed, exponent = move
    turn = rotation(seed)
    corners = np.random.default_rng(seed).normal(size=(3, 3))
    expected = turn @ np.cross(corners[1] - corners[0], corners[2] - corners[0])
    mesh = Mesh.build(corners @ turn.T * 10.0**exponent, [[0, 1, 2]])
    n = face_normals(mesh)[0]
    assert np.linalg.norm(n) == pytest.approx(1, abs=1e-12)
    # The corners were rounded to float32: 6e-8 over the height of the triangle.
    assert n @ expected / np.linalg.norm(expected) > 1 - 1e-6


@pytest.mark.parametrize("scale", [1e-38, 1e-30, 1e-10, 1e10, 1e30, 1e38])
def test_face_normals_survive_the_whole_range_of_float32(scale: float) -> None:
    mesh = Mesh.build(np.eye(3) * scale, [[0, 1, 2]])
    np.testing.assert_allclose(face_normals(mesh), [[3**-0.5] * 3], rtol=1e-6)


def test_a_triangle_without_area_has_the_stated_fallback() -> None:
    mesh = Mesh.build([[0, 0, 0], [1, 1, 1], [2, 2, 2], [0, 1, 0]], [[0, 1, 2], [0, 1, 1], [0, 1, 3]])
    np.testing.assert_array_equal(face_normals(mesh)[:2], 0)
    for kind in ("face", "smooth"):
        smooth = with_normals(mesh, kind, 60)
        assert smooth.normals is not None
        np.testing.assert_allclose(np.linalg.norm(smooth.normals, axis=1), 1, atol=1e-6)


@given(rigid)
@settings(max_examples=40, deadline=None)
def test_the_threshold_keeps_the_edges_of_a_cube_sharp(move: tuple[int, float]) -> None:
    seed, exponent = move
    turned = Mesh.build(CUBE_POSITIONS @ rotation(seed).T * 10.0**exponent, CUBE_TRIANGLES)
    for threshold, count in ((0, 24), (60, 24), (89.9, 24), (90, 24), (90.1, 8), (120, 8), (180, 8)):
        assert len(with_normals(turned, "smooth", threshold).positions) == count, threshold
    assert len(with_normals(turned, "face", 60).positions) == 36


def test_a_smooth_normal_is_weighted_by_angle_not_by_the_number_of_triangles() -> None:
    # Each corner of a cube has three right angles, however its quads are cut: the normal is the diagonal.
    mesh = with_normals(shared_cube(), "smooth", 120)
    assert mesh.normals is not None
    np.testing.assert_allclose(mesh.normals, mesh.positions / np.sqrt(3), atol=1e-6)


@given(st.integers(0, 10_000), st.floats(-10, 10), st.floats(0, 180))
@settings(max_examples=40, deadline=None)
def test_smooth_normals_turn_with_the_mesh_and_ignore_its_scale(seed: int, exponent: float, threshold: float) -> None:
    rng = np.random.default_rng(seed)
    p, t = rng.normal(size=(12, 3)), rng.integers(0, 12, size=(14, 3))
    turn = rotation(seed)
    before = with_normals(Mesh.build(p, t), "smooth", threshold)
    after = with_normals(Mesh.build(p * 2.0 ** round(3 * exponent), t), "smooth", threshold)
    assert before.normals is not None
    assert after.normals is not None
    np.testing.assert_array_equal(before.normals, after.normals)
    turned = with_normals(Mesh.build(p @ turn.T, t), "smooth", threshold)
    assert turned.normals is not None
    np.testing.assert_allclose(np.linalg.norm(turned.normals, axis=1), 1, atol=1e-6)


def test_a_fan_is_cut_only_when_both_ways_round_are_cut() -> None:
    # Eight triangles round an apex, rising steeply along one crease only: the other way round stays smooth.
    angle = np.arange(9) * np.pi / 4
    rim = np.stack([np.cos(angle), np.sin(angle), 0.1 * np.arange(9)], axis=1)
    p = np.vstack([[0, 0, 0.4], rim])
    t = [[0, k, k + 1] for k in range(1, 9)]
    opened = with_normals(Mesh.build(p, t), "smooth", 60)
    assert len(opened.positions) == 10  # the first and the last rim point are not at one place
    assert np.count_nonzero((opened.positions == opened.positions[0]).all(axis=1)) == 1


def test_a_vertex_on_a_crease_between_two_smooth_sides_has_two_normals() -> None:
    roof = [[0, 0, 1], [1, 0, 1], [0, -1, 0], [1, -1, 0], [0, 1, 0], [1, 1, 0]]
    t = [[0, 2, 3], [0, 3, 1], [0, 1, 5], [0, 5, 4]]
    assert len(with_normals(Mesh.build(roof, t), "smooth", 60).positions) == 8
    assert len(with_normals(Mesh.build(roof, t), "smooth", 100).positions) == 6


def test_normals_agree_across_uv_seams_and_vertices_stay_distinct_only_there() -> None:
    ball = primitives.sphere(16, 8)
    again = with_normals(ball, "smooth", 60)
    assert again.normals is not None
    assert again.uvs is not None
    assert len(again.positions) == len(ball.positions)
    _, where = np.unique(again.positions, axis=0, return_inverse=True)
    for place in range(where.max() + 1):
        np.testing.assert_array_equal(np.ptp(again.normals[where == place], axis=0), 0)


def test_a_soup_of_triangles_becomes_a_mesh() -> None:
    soup = with_normals(primitives.icosphere(3), "face", 0)
    assert len(soup.positions) == 3 * 1280
    welded = with_normals(soup, "smooth", 60)
    assert len(welded.positions) == 642
    assert welded.is_solid
    assert welded.normals is not None
    np.testing.assert_allclose(welded.normals, welded.positions, atol=5e-3)


def test_auto_keeps_the_files_own_normals() -> None:
    tilted = Mesh.build(np.eye(3), [[0, 1, 2]], normals=[[0, 0, 2]] * 3)
    assert with_normals(tilted, "auto", 60) is tilted
    assert tilted.normals is not None
    np.testing.assert_array_equal(tilted.normals, [[0, 0, 1]] * 3)


def test_normals_that_are_no_directions_are_replaced() -> None:
    n = CUBE_POSITIONS / np.sqrt(3)
    n[0], n[1], n[2] = 0, np.nan, [np.inf, 0, 0]
    mesh = Mesh.build(CUBE_POSITIONS, CUBE_TRIANGLES, normals=n)
    assert mesh.normals is not None
    np.testing.assert_allclose(mesh.normals, CUBE_POSITIONS / np.sqrt(3), atol=1e-6)


@pytest.mark.parametrize("value", [0.0, np.nan, np.inf])
def test_normals_without_any_direction_are_none(value: float) -> None:
    mesh = Mesh.build(CUBE_POSITIONS, CUBE_TRIANGLES, normals=np.full((8, 3), value), tangents=np.ones((8, 4)))
    assert mesh.normals is None
    assert mesh.tangents is None
    assert len(with_normals(mesh, "auto", 40).positions) == 24, "the edges of the cube are sharp"


def test_normals_that_cancel_fall_back_to_one_of_the_faces() -> None:
    both = Mesh.build([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 1]])
    smooth = with_normals(both, "smooth", 180)
    assert smooth.normals is not None
    np.testing.assert_array_equal(np.abs(smooth.normals), [[0, 0, 1]] * len(smooth.normals))


def test_unused_vertices_are_dropped() -> None:
    mesh = Mesh.build([[9, 9, 9], [0, 0, 0], [1, 0, 0], [0, 1, 0]], [[1, 2, 3]])
    for kind in ("face", "smooth"):
        assert len(with_normals(mesh, kind, 60).positions) == 3


def test_an_edge_of_many_triangles_is_no_problem() -> None:
    angle = np.arange(40) * 2 * np.pi / 40
    p = np.vstack([[[0, 0, 0], [0, 0, 1]], np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)])
    book = Mesh.build(p, [[0, 1, k] for k in range(2, 42)])
    smooth = with_normals(book, "smooth", 30)
    assert smooth.normals is not None
    np.testing.assert_allclose(np.linalg.norm(smooth.normals, axis=1), 1, atol=1e-6)


@given(st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_local_order_keeps_the_triangles_and_what_their_corners_carry(seed: int) -> None:
    rng = np.random.default_rng(seed)
    p, uv = rng.normal(size=(40, 3)), rng.uniform(size=(40, 2))
    mesh = Mesh.build(p, rng.integers(0, 40, size=(50, 3)), normals=p, uvs=uv)
    local = in_local_order(mesh)
    np.testing.assert_array_equal(corner_sets(local), corner_sets(mesh))
    used = np.unique(mesh.triangles)
    assert len(local.positions) == len(used)

    def rows(m: Mesh, which: Any) -> Array:
        assert m.normals is not None
        assert m.uvs is not None
        table = np.hstack([m.positions[which], m.normals[which], m.uvs[which]])
        return table[np.lexsort(table.T)]

    np.testing.assert_array_equal(rows(local, slice(None)), rows(mesh, used))
    first_use = np.unique(local.triangles.reshape(-1), return_index=True)[1]
    assert (np.diff(first_use) > 0).all()


def test_local_order_brings_neighbours_together() -> None:
    ball = primitives.icosphere(5)
    scattered = Mesh.build(ball.positions, ball.triangles[np.random.default_rng(0).permutation(len(ball.triangles))])

    def stride(mesh: Mesh) -> float:
        middle = mesh.positions[mesh.triangles].mean(axis=1)
        return float(np.linalg.norm(np.diff(middle, axis=0), axis=1).mean())

    assert stride(in_local_order(scattered)) < 0.1 * stride(scattered)


def test_a_mesh_in_local_order_stays_the_same_object() -> None:
    ball = in_local_order(primitives.icosphere(3))
    assert in_local_order(ball) is ball
    reread = Mesh.build(ball.positions, ball.triangles)  # as from a cache: nobody says that it is in order
    assert in_local_order(reread) is reread
    for wrong in (ball.triangles[::-1], np.roll(ball.triangles, 1, axis=1)):
        assert in_local_order(Mesh.build(ball.positions, wrong)).triangles.tolist() != wrong.tolist()


def test_tangents_follow_the_uvs() -> None:
    floor = with_tangents(primitives.plane(3))
    assert floor.tangents is not None
    np.testing.assert_allclose(floor.tangents, [[1, 0, 0, 1]] * len(floor.tangents), atol=1e-6)


@pytest.mark.parametrize("name", ["sphere", "cube", "torus", "cylinder", "cone"])
def test_tangent_frames_are_orthonormal_and_b_follows_v(name: str) -> None:
    mesh = with_tangents(primitives.PRIMITIVES[name]())
    assert mesh.tangents is not None
    assert mesh.normals is not None
    assert mesh.uvs is not None
    t, n = mesh.tangents[:, :3].astype(float), mesh.normals.astype(float)
    np.testing.assert_allclose(np.linalg.norm(t, axis=1), 1, atol=1e-6)
    np.testing.assert_allclose(np.einsum("ij,ij->i", t, n), 0, atol=1e-6)
    b = mesh.tangents[:, 3:] * np.cross(n, t)
    # Going along b must raise v, along t raise u: checked on every triangle's edges.
    p, uv = mesh.positions.astype(float)[mesh.triangles], mesh.uvs.astype(float)[mesh.triangles]
    e1, e2 = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    d1, d2 = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    det = d1[:, 0] * d2[:, 1] - d2[:, 0] * d1[:, 1]
    dpdv = (d1[:, :1] * e2 - d2[:, :1] * e1) / det[:, None]
    dpdu = (d2[:, 1:] * e1 - d1[:, 1:] * e2) / det[:, None]
    assert (np.einsum("ij,ij->i", b[mesh.triangles].mean(axis=1), dpdv) > 0).all()
    assert (np.einsum("ij,ij->i", t[mesh.triangles].mean(axis=1), dpdu) > 0).all()


def test_mirrored_uvs_split_their_vertices() -> None:
    p = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    uv = [[0, 0], [1, 0], [1, 1], [1, 0]]  # both triangles map to one half of the picture
    mesh = Mesh.build(p, [[0, 1, 2], [0, 2, 3]], normals=[[0, 0, 1]] * 4, uvs=uv)
    tangents = with_tangents(mesh)
    assert tangents.tangents is not None
    assert len(tangents.positions) == 6
    w = tangents.tangents[tangents.triangles][:, :, 3]
    np.testing.assert_array_equal(w, [[1] * 3, [-1] * 3])
    np.testing.assert_array_equal(tangents.positions[tangents.triangles], mesh.positions[mesh.triangles])


def test_uvs_without_extent_fall_back_to_the_brushed_direction() -> None:
    ball = primitives.icosphere(2)
    flat = Mesh.build(ball.positions, ball.triangles, normals=ball.normals, uvs=np.zeros((len(ball.positions), 2)))
    plain, degenerate = with_tangents(ball).tangents, with_tangents(flat)
    assert plain is not None
    assert degenerate.tangents is not None
    assert degenerate.normals is not None
    t = degenerate.tangents[:, :3]
    np.testing.assert_allclose(np.linalg.norm(t, axis=1), 1, atol=1e-6)
    np.testing.assert_allclose(t, brushed(degenerate.normals), atol=1e-6)
    np.testing.assert_array_equal(degenerate.tangents[:, 3], 1)


def test_brushed_runs_round_the_y_axis_and_is_defined_at_its_poles() -> None:
    n = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0], [0, -1, 0]], dtype=float)
    np.testing.assert_allclose(brushed(n), [[1, 0, 0], [0, 0, -1], [1, 0, 0], [1, 0, 0]], atol=1e-12)
    rng = np.random.default_rng(1)
    near = np.stack([1e-7 * rng.normal(size=50), np.ones(50), 1e-5 * rng.normal(size=50)], axis=1)
    near /= np.linalg.norm(near, axis=1, keepdims=True)
    np.testing.assert_allclose(np.linalg.norm(brushed(near), axis=1), 1, atol=1e-12)
    np.testing.assert_allclose(np.einsum("ij,ij->i", brushed(near), near), 0, atol=1e-12)


def test_faceted_carries_one_value_a_triangle() -> None:
    whole = with_tangents(primitives.sphere(12, 6))
    mesh = faceted(whole)
    assert mesh.centroids is not None
    assert mesh.centroid_uvs is not None
    assert whole.uvs is not None
    assert mesh.normals is not None
    assert mesh.uvs is not None
    assert mesh.tangents is not None
    assert len(mesh.positions) == 3 * len(mesh.triangles)
    for array in (mesh.centroids, mesh.normals, mesh.centroid_uvs, mesh.tangents):
        np.testing.assert_array_equal(np.ptp(array[mesh.triangles], axis=1), 0)
    corners = mesh.positions[mesh.triangles].astype(float)
    np.testing.assert_allclose(mesh.centroids[::3], corners.mean(axis=1), atol=1e-7)
    np.testing.assert_allclose(mesh.normals[::3], face_normals(mesh), atol=1e-7)
    # The corners keep their own uvs: a cut-out follows its texture within the triangle.
    np.testing.assert_array_equal(mesh.uvs[mesh.triangles], whole.uvs[whole.triangles])
    np.testing.assert_allclose(mesh.centroid_uvs[::3], whole.uvs[whole.triangles].mean(axis=1), atol=1e-7)
    np.testing.assert_allclose(np.einsum("ij,ij->i", mesh.tangents[:, :3], mesh.normals), 0, atol=1e-6)


@pytest.mark.parametrize("distance", [0.5, 1e3, 1e6, 1e12])
def test_a_mesh_far_from_its_origin_keeps_its_shape(distance: float) -> None:
    moved = CUBE_POSITIONS + np.array([distance, 0, 0])
    mesh = Mesh.build(moved, CUBE_TRIANGLES)
    np.testing.assert_allclose(mesh.positions + mesh.origin, moved, rtol=1e-12)
    np.testing.assert_allclose(mesh.bounds, [moved.min(axis=0), moved.max(axis=0)], rtol=1e-12)
    assert mesh.is_solid
    assert (distance < 2) == (not mesh.origin.any())  # near ones keep their exact bytes


@pytest.mark.parametrize(
    ("positions", "triangles", "message"),
    [
        (np.zeros((0, 3)), [[0, 1, 2]], "no positions"),
        (np.eye(3), np.zeros((0, 3), dtype=int), "no triangles"),
        (np.eye(3), [[0, 1, 3]], "index 3 is out of range"),
        (np.eye(3), [[0, 1, -1]], "index -1 is out of range"),
        ([[0, 0, 0], [1, np.nan, 0], [0, 1, 0]], [[0, 1, 2]], "none of its 1 triangles .* not finite"),
        ([[0, 0, 0], [np.inf, 0, 0], [0, 1, 0]], [[0, 1, 2]], "none of its 1 triangles .* not finite"),
        (np.eye(3) * 1e39, [[0, 1, 2]], "too large"),
        (np.eye(3) * 1.7e308, [[0, 1, 2]], "too large"),
        (np.eye(3)[:, :2], [[0, 1, 2]], "shape"),
    ],
)
def test_build_refuses_what_cannot_be_drawn(positions: Any, triangles: Any, message: str) -> None:
    with pytest.raises(AssetError, match=message):
        Mesh.build(positions, triangles)


def test_a_mesh_has_arrays_of_its_own() -> None:
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype=np.float32)
    triangles, origin = np.array([[0, 1, 2]], dtype=np.uint32), np.zeros(3)
    # The view is read-only, but its owner is not.
    view = positions.view()
    view.flags.writeable = False
    meshes = [Mesh(given, triangles, normals=given, origin=origin) for given in (positions, view)]
    before = [mesh.digest for mesh in meshes]
    positions[:], triangles[:], origin[:] = 5, 0, 5
    for mesh, digest in zip(meshes, before, strict=True):
        assert mesh.positions[1].tolist() == [1, 0, 0]
        assert Mesh(mesh.positions, mesh.triangles, mesh.normals, origin=mesh.origin).digest == digest
        assert Mesh(mesh.positions, mesh.triangles).positions is mesh.positions, "what nobody can write to is not copied"


def test_arrays_are_read_only_and_the_digest_is_of_their_bytes() -> None:
    mesh = shared_cube()
    with pytest.raises(ValueError, match="read-only"):
        mesh.positions[0, 0] = 5
    assert mesh.digest == shared_cube().digest
    nudged = CUBE_POSITIONS.copy()
    nudged[0, 0] = np.nextafter(np.float32(-1), np.float32(0))
    assert mesh.digest != Mesh.build(nudged, CUBE_TRIANGLES).digest


def test_is_solid_means_closed_and_wound_outward() -> None:
    cube = shared_cube()
    assert cube.is_solid
    assert not Mesh.build(CUBE_POSITIONS, CUBE_TRIANGLES[:, ::-1]).is_solid, "inside out"
    assert not Mesh.build(CUBE_POSITIONS, CUBE_TRIANGLES[1:]).is_solid, "open"
    one_flipped = CUBE_TRIANGLES.copy()
    one_flipped[0] = one_flipped[0, ::-1]
    assert not Mesh.build(CUBE_POSITIONS, one_flipped).is_solid
    assert not Mesh.build(CUBE_POSITIONS, np.vstack([CUBE_TRIANGLES, CUBE_TRIANGLES[:1]])).is_solid, "doubled"
    assert not Mesh.build(np.eye(3), [[0, 1, 2], [0, 2, 1]]).is_solid, "folded sheet"
    assert with_normals(cube, "face", 0).is_solid, "vertices at one place count as one"
    assert Mesh.build(CUBE_POSITIONS, np.vstack([CUBE_TRIANGLES, [[0, 0, 1]]])).is_solid, "degenerate ones are ignored"
    corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-0.0, 0.0, 0.0]]
    signed_zeros = Mesh.build(corners, [[0, 2, 1], [4, 1, 3], [0, 3, 2], [1, 2, 3]])
    assert signed_zeros.is_solid


@given(st.integers(0, 10_000))
@settings(max_examples=200, deadline=None)
def test_is_solid_agrees_with_counting_edges(seed: int) -> None:
    rng = np.random.default_rng(seed)
    p, t = CUBE_POSITIONS * rng.choice([1.0, -1.0]), CUBE_TRIANGLES.copy()
    for _ in range(rng.integers(0, 3)):
        k = rng.integers(len(t))
        changed = [t[k][::-1], np.roll(t[k], 1), [t[k][0], t[k][0], t[k][1]]][rng.integers(3)]
        t = np.vstack([t, [changed]]) if rng.integers(2) else np.vstack([t[:k], [changed], t[k + 1 :]])
    mesh = Mesh.build(p, t)
    places = [tuple(row) for row in (p + 0.0).tolist()]
    kept = [[places[i] for i in row] for row in t.tolist() if len({places[i] for i in row}) == 3]
    edges = [(row[i - 1], row[i]) for row in kept for i in range(3)]
    closed = len(set(edges)) == len(edges) and {(b, a) for a, b in edges} == set(edges)
    volume = sum(np.linalg.det(np.array(row)) for row in kept)
    assert mesh.is_solid == (closed and volume > 1e-9)


@given(st.integers(0, 10_000))
@settings(max_examples=100, deadline=None)
def test_vertices_are_welded_by_exact_equality(seed: int) -> None:
    rng = np.random.default_rng(seed)
    # A few values, both zeros, and neighbours of 1 in the last place: many rows are equal, many nearly so.
    values = np.array([0.0, -0.0, 1.0, np.nextafter(np.float32(1), np.float32(2)), -1.0, 1e-45], dtype=np.float32)
    p = values[rng.integers(0, len(values), size=(rng.integers(3, 400), 3))]
    label = weld(p)
    _, expected = np.unique(p + 0, axis=0, return_inverse=True)
    assert len(set(zip(label.tolist(), expected.reshape(-1).tolist(), strict=True))) == label.max() + 1 == expected.max() + 1
