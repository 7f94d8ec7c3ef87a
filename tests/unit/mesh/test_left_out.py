"""What is left out of a mesh: vertices that no triangle uses, and values that are not finite."""

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
from glshade.errors import AssetError, AssetWarning
from glshade.mesh.file import load
from glshade.mesh.mesh import Mesh

Array = np.ndarray[Any, Any]
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
# A place in UTM coordinates [m].
UTM = np.array([500_000.0, 5_400_000.0, 300.0])
# What a vertex that no triangle uses may hold.
ANYTHING = st.sampled_from([0.0, 1e30, -1e300, np.nan, np.inf, -np.inf])


@given(stray=st.tuples(ANYTHING, ANYTHING, ANYTHING), place=st.integers(0, 4))
def test_a_vertex_that_no_triangle_uses_changes_nothing(stray: tuple[float, float, float], place: int) -> None:
    positions = np.insert(CORNERS + UTM, place, stray, axis=0)
    triangles = np.delete(np.arange(5), place)[TETRAHEDRON]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mesh, clean = Mesh.build(positions, triangles), Mesh.build(CORNERS + UTM, TETRAHEDRON)
    assert mesh.digest == clean.digest
    np.testing.assert_allclose(mesh.positions + mesh.origin, CORNERS + UTM, rtol=1e-12)
    assert mesh.is_solid


def test_a_mesh_made_without_checks_has_the_bounds_of_its_triangles_too() -> None:
    stray = np.vstack([CORNERS, [[1e6, 0, np.nan]]])
    mesh = Mesh(stray.astype(np.float32), TETRAHEDRON.astype(np.uint32))
    np.testing.assert_array_equal(mesh.bounds, [[0, 0, 0], [1, 1, 1]])
    assert mesh.is_solid
    seen = assemble(Scene.model_validate({"objects": [{"mesh": mesh}]})).view
    assert np.linalg.norm(seen.eye) < 10


PLY = "ply\nformat ascii 1.0\nelement vertex {n}\nproperty double x\nproperty double y\nproperty double z\n"
PLY += "element face {t}\nproperty list uchar int vertex_indices\nend_header\n"


def ply(path: Path, positions: Array, triangles: Array) -> Path:
    lines = [" ".join(f"{x:.6f}" for x in row) for row in positions] + [f"3 {a} {b} {c}" for a, b, c in triangles]
    path.write_text(PLY.format(n=len(positions), t=len(triangles)) + "\n".join(lines) + "\n")
    return path


def test_one_unused_vertex_at_0_does_not_move_the_view_of_a_survey(tmp_path: Path) -> None:
    clean = ply(tmp_path / "clean.ply", CORNERS + UTM, TETRAHEDRON)
    stray = ply(tmp_path / "stray.ply", np.vstack([CORNERS + UTM, np.zeros((1, 3))]), TETRAHEDRON)
    views = [assemble(Scene.model_validate({"objects": [{"mesh": str(path)}]})).view for path in (clean, stray)]
    np.testing.assert_array_equal(views[0].eye, views[1].eye)
    mesh = load(stray).parts[0].mesh
    np.testing.assert_allclose(mesh.positions + mesh.origin, CORNERS + UTM, atol=1e-6)


def test_a_bare_mesh_is_seen_from_the_same_side_however_it_is_written(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    eyes = []
    for number in range(4):
        order = rng.permutation(4)
        positions, triangles = CORNERS[order], np.argsort(order)[TETRAHEDRON][rng.permutation(4)]
        positions = np.vstack([positions, rng.normal(size=(number, 3)) * 100])
        path = ply(tmp_path / f"{number}.ply", positions, triangles)
        eyes.append(assemble(Scene.model_validate({"objects": [{"mesh": str(path)}]})).view.eye)
    np.testing.assert_array_equal(np.ptp(eyes, axis=0), 0)


@given(seed=st.integers(0, 1000), bad=st.sampled_from([np.nan, np.inf, -np.inf]))
def test_triangles_with_a_corner_that_is_not_finite_are_left_out_and_counted(seed: int, bad: float) -> None:
    rng = np.random.default_rng(seed)
    positions, triangles = rng.normal(size=(20, 3)), rng.integers(0, 20, size=(30, 3))
    spoilt = rng.choice(20, size=3, replace=False)
    positions[spoilt, rng.integers(0, 3, 3)] = bad
    kept = ~np.isin(triangles, spoilt).any(axis=1)
    triangles[0], triangles[1] = spoilt, np.setdiff1d(np.arange(20), spoilt)[:3]
    kept[:2] = False, True
    with pytest.warns(AssetWarning, match=f"^{30 - kept.sum()} of 30 triangles are left out: a corner is not finite"):
        mesh = Mesh.build(positions, triangles, uvs=np.zeros((20, 2)))
    np.testing.assert_array_equal(mesh.positions[mesh.triangles], positions[triangles[kept]].astype(np.float32))
    assert np.isfinite(mesh.bounds).all()


def test_a_mesh_of_which_nothing_is_left_is_an_error() -> None:
    with pytest.raises(AssetError, match="none of its 4 triangles can be drawn"):
        Mesh.build(np.where(CORNERS == 0, np.nan, CORNERS), TETRAHEDRON)


def test_a_file_gets_one_warning_that_counts_the_triangles_of_all_its_parts(tmp_path: Path) -> None:
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\n"
    text += "".join(f"o part{k}\nf 1 2 3\nf 1 2 4\n" for k in range(3))
    path = tmp_path / "parts.obj"
    path.write_text(text)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        model = load(path)
    assert [str(w.message) for w in caught] == [
        f"{path}: 3 of 6 triangles are left out: a corner is not finite (NaN or infinite)"
    ]
    assert [len(part.mesh.triangles) for part in model.parts] == [1, 1, 1]


def test_a_file_of_triangles_without_area_says_so(tmp_path: Path) -> None:
    path = ply(tmp_path / "line.ply", np.outer(np.arange(3), [1.0, 2.0, 3.0]), np.array([[0, 1, 2], [0, 0, 1]]))
    with pytest.warns(AssetWarning, match="none of its 2 triangles has an area, so they are not visible"):
        load(path)


def test_uvs_and_colours_that_are_not_finite_are_replaced_and_counted() -> None:
    uvs = CORNERS[:, :2].copy()
    uvs[1] = np.nan, 0.5
    colours = np.full((4, 4), 0.25)
    colours[2, 3], colours[3, 0] = np.inf, 1e300
    with pytest.warns(AssetWarning) as caught:
        mesh = Mesh.build(CORNERS, TETRAHEDRON, uvs=uvs, colours=colours)
    assert [str(w.message) for w in caught] == [
        "texture coordinates of 1 vertices are not finite; (0, 0) is used there",
        "colours of 2 vertices are not finite; white is used there",
    ]
    assert mesh.uvs is not None
    assert mesh.colours is not None
    np.testing.assert_array_equal(mesh.uvs[1], 0)
    np.testing.assert_array_equal(mesh.colours, [[0.25] * 4, [0.25] * 4, [1] * 4, [1] * 4])


@pytest.mark.parametrize("name", ["normals", "uvs", "colours"])
def test_arrays_of_other_lengths_are_refused(name: str) -> None:
    given: Any = {name: np.ones((3, {"normals": 3, "uvs": 2, "colours": 4}[name]))}
    with pytest.raises(AssetError, match=f"4 positions and 3 {name}"):
        Mesh.build(CORNERS, TETRAHEDRON, **given)


def test_given_tangents_are_made_unit_and_perpendicular_and_are_kept() -> None:
    normals = np.tile([0.0, 0.0, 2.0], (4, 1))
    tangents = [[3, 0, 5, 1], [0, 2, 0, -0.5], [0, 0, 4, -1], [np.nan, 0, 0, 1]]
    mesh = Mesh.build(CORNERS, TETRAHEDRON, normals=normals, tangents=tangents)
    assert mesh.tangents is not None
    np.testing.assert_allclose(mesh.tangents[:2], [[1, 0, 0, 1], [0, 1, 0, -1]], atol=1e-6)
    np.testing.assert_allclose(mesh.tangents[2:], [[1, 0, 0, 1], [1, 0, 0, 1]], atol=1e-6)
