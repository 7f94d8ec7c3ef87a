"""Topology: the edges of a mesh, which are found once for all meshes with the same triangles."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glshade.arrays import Array
from glshade.mesh import primitives
from glshade.mesh import topology as module
from glshade.mesh.mesh import Mesh
from glshade.mesh.normals import with_normals
from glshade.mesh.order import ORDERED_ABOVE, in_local_order, is_coherent, ordered
from glshade.mesh.topology import Topology, topology_of


def sheet(seed: int, height: float) -> tuple[Array, Array]:
    """Returns the positions and triangles of a sheet of 6 x 6 squares, whose vertices have random heights."""
    x, y = np.meshgrid(np.arange(7.0), np.arange(7.0))
    z = height * np.random.default_rng(seed).uniform(size=x.shape)
    corner = (np.arange(6)[:, None] * 7 + np.arange(6)).reshape(-1, 1)
    triangles = np.concatenate([np.add(corner, (0, 1, 8)), np.add(corner, (0, 8, 7))])
    return np.stack([x, y, z], axis=-1).reshape(-1, 3), triangles


def made(positions: Array, triangles: Array, threshold: float, uvs: Array | None) -> tuple[bytes, bool]:
    """Returns the digest of a mesh with smooth normals, and whether it is solid."""
    mesh = Mesh.build(positions, triangles, uvs=uvs)
    return with_normals(mesh, "smooth", threshold).digest.encode(), mesh.is_solid


@given(
    st.lists(st.tuples(st.integers(0, 99), st.sampled_from([0.0, 0.3, 3.0])), min_size=2, max_size=5),
    st.sampled_from([20.0, 60.0, 180.0]),
    st.booleans(),
)
@settings(max_examples=30, deadline=None)
def test_a_mesh_that_moves_is_the_one_that_is_built_anew(
    frames: list[tuple[int, float]], threshold: float, mapped: bool
) -> None:
    """Some edges turn sharp and smooth again from frame to frame."""
    uvs = np.random.default_rng(0).uniform(size=(49, 2)) if mapped else None
    moving = [made(*sheet(*frame), threshold, uvs) for frame in frames]
    for frame, result in zip(frames, moving, strict=True):
        module._recent.clear()
        assert made(*sheet(*frame), threshold, uvs) == result


def test_meshes_with_the_same_triangles_share_their_topology() -> None:
    ball = primitives.icosphere(2)
    first = topology_of(Mesh.build(ball.positions, ball.triangles))
    assert topology_of(Mesh.build(ball.positions * 2 + ball.positions[:, :1] ** 2, ball.triangles.copy())) is first
    assert topology_of(Mesh.build(ball.positions, ball.triangles[::-1])) is not first


def test_vertices_that_meet_make_another_topology() -> None:
    """Two triangles share an edge only while their corners lie at equal positions."""
    apart = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], dtype=np.float64)
    triangles = np.arange(6).reshape(2, 3)
    assert len(topology_of(Mesh.build(apart, triangles)).pairs[0]) == 1
    apart[5, 2] = 1
    assert len(topology_of(Mesh.build(apart, triangles)).pairs[0]) == 0


def test_large_meshes_are_not_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "KEPT", 100)
    module._recent.clear()
    mesh = primitives.icosphere(1)
    assert topology_of(mesh) is not topology_of(mesh)
    assert len(module._recent) == 0


def closed_by_counting(places: Any) -> bool:
    """Returns what `Topology.is_closed` says, from the definition."""
    kept = [t for t in places if len(set(t)) == 3]
    edges = Counter((t[k], t[(k + 1) % 3]) for t in kept for k in range(3))
    return bool(edges) and all(edges[b, a] == count == 1 for (a, b), count in edges.items())


TETRAHEDRON = [(0, 1, 2), (0, 3, 1), (1, 3, 2), (0, 2, 3)]


@given(st.lists(st.tuples(*[st.integers(0, 4)] * 3), max_size=4), st.sampled_from([[], TETRAHEDRON, TETRAHEDRON * 2]))
@settings(max_examples=300, deadline=None)
def test_closed_is_what_counting_says(some: list[tuple[int, int, int]], solid: list[tuple[int, int, int]]) -> None:
    triangles = np.array(solid + some, dtype=np.uint32).reshape(-1, 3)
    assert Topology(triangles, np.arange(5)).is_closed == closed_by_counting(solid + some)


def test_a_coherent_mesh_keeps_its_order_and_a_scattered_one_is_sorted() -> None:
    rng = np.random.default_rng(1)
    ball = in_local_order(primitives.icosphere(4))
    grid = primitives.sphere(64, 32)
    for coherent in (ball, grid):
        assert len(coherent.triangles) > ORDERED_ABOVE
        assert ordered(coherent) is coherent
    shuffled = rng.permutation(len(ball.positions))
    of_triangles = Mesh.build(ball.positions, rng.permutation(ball.triangles))
    of_vertices = Mesh.build(ball.positions[shuffled], np.argsort(shuffled)[ball.triangles])
    # Separate triangles of which each follows one on another side of the ball: near each other in memory, but not in space.
    apart = ball.positions[ball.triangles.reshape(32, -1, 3).swapaxes(0, 1).reshape(-1)]
    interleaved = Mesh.build(apart, np.arange(len(apart)).reshape(-1, 3))
    for scattered in (of_triangles, of_vertices, interleaved):
        assert not is_coherent(scattered)
        assert ordered(scattered) is not scattered
        assert is_coherent(in_local_order(scattered))
