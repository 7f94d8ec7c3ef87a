"""Subdivision and refinement: finer meshes of the same shape, and vertices where light asks for them."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glshade.mesh import primitives, subdivision
from glshade.mesh.facets import faceted
from glshade.mesh.geometry import face_normals
from glshade.mesh.mesh import Mesh
from glshade.mesh.normals import with_normals
from glshade.mesh.subdivision import Edges, refined, split, subdivided
from glshade.mesh.tangents import with_tangents
from glshade.mesh.welding import weld
from glshade.radiance.readying import ready

Array = np.ndarray[Any, Any]
KEY = {"type": "directional", "direction": [0.4, -0.5, -0.8]}
GLOSSY = {"brdf": "phong", "kd": 0.3, "ks": 0.6, "exponent": 100}
# Faces share corners, or have corners of their own at the same places, or are open.
MESHES = {
    "sphere": primitives.icosphere(1),
    "cube": with_normals(primitives.cube(), "face", 60),
    "torus": primitives.torus(12, 8),
    "plane": primitives.plane(3),
    "flat": faceted(primitives.icosphere(1)),
}


def areas(mesh: Mesh) -> Array:
    """Of each triangle, in float64."""
    a, b, c = (mesh.positions[corner].astype(np.float64) for corner in mesh.triangles.T)
    return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2)


def volume(mesh: Mesh) -> float:
    a, b, c = (mesh.positions[corner].astype(np.float64) for corner in mesh.triangles.T)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def lobe(direction: Any, p: float) -> Any:
    """Light about a direction, of vertices that stand for directions."""
    d = np.asarray(direction) / np.linalg.norm(direction)

    def light(mesh: Mesh) -> Array:
        x = mesh.positions + mesh.origin
        x = x / np.maximum(np.linalg.norm(x, axis=1), 1e-9)[:, None]
        return np.asarray(np.maximum(x @ d, 0)[:, None] ** p)

    return light


def off(mesh: Mesh, light: Any, seed: int = 0) -> float:
    """How far interpolated light is off, at places chosen at random in every triangle."""
    weights = np.random.default_rng(seed).dirichlet((1, 1, 1), size=(16, len(mesh.triangles)))
    shown = light(mesh)[mesh.triangles]
    worst = 0.0
    for w in weights:
        between = np.einsum("tk,tkc->tc", w, shown)
        places = np.einsum("tk,tkc->tc", w, mesh.positions[mesh.triangles].astype(np.float64))
        there = light(Mesh(positions=places, triangles=np.zeros((0, 3), dtype=np.uint32), origin=mesh.origin))
        worst = max(worst, float(np.abs(there - between).max()))
    return worst


class TestSubdivided:
    """Every triangle in four."""

    @pytest.mark.parametrize("name", MESHES)
    def test_shape_stays(self, name: str) -> None:
        mesh = MESHES[name]
        for levels in (0, 1, 2):
            finer = subdivided(mesh, levels)
            assert len(finer.triangles) == len(mesh.triangles) * 4**levels
            assert np.allclose(np.sort(areas(finer)), np.sort(np.repeat(areas(mesh), 4**levels)) / 4**levels, rtol=1e-4)
            assert np.array_equal(finer.bounds, mesh.bounds)
            assert finer.is_solid == mesh.is_solid
            assert volume(finer) == pytest.approx(volume(mesh), rel=1e-5, abs=1e-6)
            # Each piece faces where a triangle faced: nothing is turned over, nothing bulges.
            facing = face_normals(finer) @ face_normals(mesh).T
            assert facing.max(axis=1).min() > 1 - 1e-5

    def test_nothing_is_there_twice(self) -> None:
        """Euler: a closed surface of the sphere's kind has V - E + F = 2, and each cut adds its edges to its vertices."""
        mesh = MESHES["sphere"]
        finer = subdivided(mesh, 1)
        assert len(finer.positions) == len(mesh.positions) + len(mesh.triangles) * 3 // 2
        assert len(np.unique(weld(finer.positions))) == len(finer.positions)

    def test_normals_are_those_between(self) -> None:
        mesh = MESHES["sphere"]
        finer = subdivided(mesh, 3)
        assert finer.normals is not None
        assert np.allclose(np.linalg.norm(finer.normals, axis=1), 1, atol=1e-6)
        # The middle of an edge of a ball has the normal of the ball there, by symmetry.
        once = subdivided(mesh, 1)
        assert once.normals is not None
        radial = once.positions + once.origin
        assert np.allclose(once.normals, radial / np.linalg.norm(radial, axis=1)[:, None], atol=1e-5)

    def test_what_is_linear_stays_linear(self) -> None:
        plane = primitives.plane(2)
        colours = np.column_stack([plane.positions * 0.3 + 0.5, np.ones(len(plane.positions))])
        assert plane.uvs is not None
        mesh = Mesh.build(plane.positions, plane.triangles, plane.normals, plane.uvs, colours)
        finer = subdivided(mesh, 2)
        assert finer.uvs is not None
        assert finer.colours is not None
        # u and v grow with x and z alone.
        slope, *_ = np.linalg.lstsq(np.column_stack([plane.positions, np.ones(len(plane.positions))]), plane.uvs, rcond=None)
        assert np.allclose(finer.uvs, np.column_stack([finer.positions, np.ones(len(finer.positions))]) @ slope, atol=1e-5)
        assert np.allclose(finer.colours[:, :3], finer.positions * 0.3 + 0.5, atol=1e-5)
        assert np.allclose(finer.colours[:, 3], 1)

    def test_tangents_stay_perpendicular_and_keep_their_hand(self) -> None:
        mesh = with_tangents(primitives.torus(12, 8))
        finer = subdivided(mesh, 2)
        assert finer.tangents is not None
        assert finer.normals is not None
        assert mesh.tangents is not None
        assert np.abs(np.einsum("ij,ij->i", finer.tangents[:, :3], finer.normals)).max() < 1e-5
        assert np.allclose(np.linalg.norm(finer.tangents[:, :3], axis=1), 1, atol=1e-5)
        assert set(np.unique(finer.tangents[:, 3])) == set(np.unique(mesh.tangents[:, 3]))


class TestSplit:
    """Some edges cut, whichever."""

    @settings(max_examples=30)
    @given(seed=st.integers(0, 10**6), share=st.floats(0, 1), name=st.sampled_from(sorted(MESHES)))
    def test_nothing_gapes_and_nothing_overlaps(self, seed: int, share: float, name: str) -> None:
        mesh = MESHES[name]
        edges = Edges.of(mesh)
        marked = edges.together(np.random.default_rng(seed).random(len(edges.ends)) < share)
        finer = split(mesh, edges, marked)
        per_triangle = marked[edges.sides].sum(axis=1)
        assert len(finer.triangles) == len(mesh.triangles) + per_triangle.sum()
        assert len(finer.positions) == len(mesh.positions) + marked.sum()
        assert areas(finer).sum() == pytest.approx(areas(mesh).sum(), rel=1e-5)
        assert areas(finer).min() > 0
        assert finer.is_solid == mesh.is_solid
        # What stayed whole comes first, as it was.
        whole = mesh.triangles[per_triangle == 0]
        assert np.array_equal(finer.triangles[: len(whole)], whole)

    def test_edges_at_one_place_go_together(self) -> None:
        mesh = MESHES["flat"]
        edges = Edges.of(mesh)
        # Each triangle has edges of its own, and each lies on one other.
        assert len(edges.ends) == 3 * len(mesh.triangles)
        one = np.zeros(len(edges.ends), dtype=bool)
        one[0] = True
        assert edges.together(one).sum() == 2


class TestRefined:
    """Cut where light asks for it."""

    @settings(max_examples=12)
    @given(
        direction=st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda d: np.linalg.norm(d) > 0.1),
        p=st.floats(1, 60),
        tolerance=st.floats(0.01, 0.2),
    )
    def test_keeps_its_word(self, direction: Any, p: float, tolerance: float) -> None:
        """What is looked at are edges and middles, so that in between it may be off by a little more."""
        mesh = primitives.icosphere(2)
        light = lobe(direction, p)
        finer = refined(mesh, light, tolerance)
        assert off(finer, light) < 1.5 * tolerance
        assert finer.is_solid

    def test_light_that_is_linear_needs_nothing(self) -> None:
        mesh = MESHES["torus"]
        assert refined(mesh, lambda m: m.positions @ np.array([[1.0], [2.0], [3.0]]), 1e-4) is mesh

    def test_the_smaller_the_tolerance_the_more_vertices(self) -> None:
        mesh, light = primitives.icosphere(2), lobe((1, 2, 3), 50)
        counts = [len(refined(mesh, light, t).positions) for t in (1e-1, 3e-2, 1e-2, 3e-3)]
        assert all(fewer < more for fewer, more in pairwise(counts)), counts

    def test_vertices_go_where_light_bends(self) -> None:
        direction = np.array([0.0, 0.6, 0.8])
        mesh = refined(primitives.icosphere(2), lobe(direction, 100), 5e-3)
        cosine = mesh.positions @ direction / np.linalg.norm(mesh.positions, axis=1)
        # The lobe lies within 0.4 rad of its middle, 4 % of the ball.
        assert (cosine > np.cos(0.5)).mean() > 0.7
        assert np.array_equal(np.sort(mesh.positions[cosine < 0], axis=0), _behind(primitives.icosphere(2), direction))

    def test_fewer_than_uniform_at_the_same_error(self) -> None:
        mesh, light = primitives.icosphere(2), lobe((1, 2, 3), 50)
        uniform = subdivided(mesh, 3)
        finer = refined(mesh, light, off(uniform, light))
        assert off(finer, light) <= 1.5 * off(uniform, light)
        assert len(finer.positions) < len(uniform.positions) / 3

    def test_an_edge_of_light_ends_somewhere(self) -> None:
        """A step is off however fine the mesh: cutting stops at 2^8 pieces an edge."""
        mesh = primitives.plane(1)
        finer = refined(mesh, lambda m: (m.positions[:, :1] + m.positions[:, 2:] * 0.1 > 0.123).astype(float), 0.01)
        a, b, _ = (finer.positions[corner] for corner in finer.triangles.T)
        assert np.linalg.norm(b - a, axis=1).min() >= 2 / 2**subdivision.DEEPEST - 1e-6
        assert len(finer.triangles) < 40_000

    def test_no_more_than_memory_holds(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(subdivision, "LARGEST", 3_000)
        finer = refined(primitives.icosphere(2), lobe((1, 2, 3), 50), 1e-5)
        assert 320 < len(finer.triangles) <= 3_000

    def test_both_sides_of_a_seam(self) -> None:
        """Faces with corners of their own: what is cut on one side is cut on the other."""
        mesh = refined(MESHES["cube"], lobe((1, 1, 0.2), 30), 0.02)
        assert mesh.is_solid
        assert len(mesh.triangles) > 100


def _behind(mesh: Mesh, direction: Array) -> Array:
    return np.sort(mesh.positions[mesh.positions @ direction < 0], axis=0)


class TestInAScene:
    """What refinement does to the instances of a scene."""

    def test_only_those_that_ask_and_are_shaded_per_vertex(self, draw: Any) -> None:
        ball = {"shape": {"type": "icosphere", "subdivisions": 2}, "material": GLOSSY}
        scene = draw.scene(
            [
                {**ball, "shading": "gouraud"},
                {**ball, "shading": "gouraud", "quality": {"refine": 0.01}},
                {**ball, "shading": "phong", "quality": {"refine": 0.01}},
                {**ball, "shading": "flat", "quality": {"refine": 0.01}},
            ],
            [KEY],
        )
        counts = [len(i.mesh.triangles) for i in ready(scene).instances]
        assert counts[0] == counts[2] == counts[3] == 320
        assert counts[1] > 400

    def test_hangs_on_the_light_and_the_view(self, draw: Any) -> None:
        ball = {"shape": {"type": "icosphere", "subdivisions": 2}, "material": GLOSSY, "shading": "gouraud"}

        def highlight(direction: list[float]) -> Array:
            """Where most vertices are."""
            light = {**KEY, "direction": direction}
            scene = draw.scene([ball], [light], quality={"refine": 0.01}, camera={"type": "orthographic", "eye": [0, 0, 5]})
            return np.asarray(np.median(ready(scene).instances[0].mesh.positions, axis=0))

        assert highlight([-0.6, 0, -0.8])[0] > 0.1
        assert highlight([0.6, 0, -0.8])[0] < -0.1

    def test_what_is_seen_from_behind_is_refined_for_that_side(self, draw: Any) -> None:
        sheet = {"shape": "plane", "transform": {"rotate": [-90, 0, 0]}, "material": GLOSSY, "shading": "gouraud"}
        lamp = {"type": "point", "position": [0.2, 0.1, -0.7], "falloff": "none"}
        pictures = [
            draw([{**sheet, **more}], [lamp], (64, 64), camera={"eye": [0, 0, -4], "target": [0, 0, 0]})
            for more in ({"quality": {"refine": 0.01}}, {"shading": "phong"}, {})
        ]
        assert np.abs(pictures[0] - pictures[1]).max() < 0.02 < np.abs(pictures[2] - pictures[1]).max()
