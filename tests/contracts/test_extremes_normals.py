"""Property: only the direction of a vertex normal matters, not its length. A normal of length 0 counts as no normal."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.judge import BALL, CAMERA, MATERIALS, SUN, judge, judge_all, scene

from glshade import BRDFS, Mesh, Renderer
from glshade.mesh.primitives import icosphere

# Interior pixels, relative to max(1, |c|). Measured: 4.0e-6 beside normals of no length, 2.0e-6 elsewhere.
WORST = 5e-5
MESH = icosphere(2)


def with_lengths(length: float, every: int, material: Any) -> Any:
    """Returns a sphere in which one normal in `every` has the given length. Normals are uploaded without normalisation."""
    assert MESH.normals is not None
    normals = MESH.normals.astype(np.float64)
    normals[::every] *= length
    return scene(
        {"mesh": Mesh(MESH.positions, MESH.triangles, normals.astype(np.float32)), "material": material}, [SUN], camera=CAMERA
    )


@pytest.mark.parametrize("every", [1, 3])
@pytest.mark.parametrize("length", [0.0, 1e-30, 1e-20, 1e-4, 1e4, 1e19, 3e38])
def test_of_any_length(length: float, every: int, renderer: Renderer) -> None:
    drawn, worst = judge_all(lambda material: with_lengths(length, every, material), renderer)
    assert drawn > 500
    assert worst <= WORST


@pytest.mark.parametrize("length", [1e-45, 1e-40])
def test_denormal_normals(length: float, renderer: Renderer) -> None:
    """A stage may flush denormal normals to 0, which gives the picture without normals, or give the reference's picture."""
    for material in MATERIALS.values():
        for rate in ("phong", "gouraud"):
            pixels = [
                renderer.render(with_lengths(x, 1, material), dtype="float32", shading=rate).pixels.copy()  # type: ignore[arg-type]
                for x in (length, 0.0)
            ]
            assert judge(with_lengths(0.0, 1, material), renderer, rate).drawn > 500  # type: ignore[arg-type]
            flushed = np.array_equal(*pixels)
            assert flushed or judge(with_lengths(length, 1, material), renderer, rate).drawn > 500  # type: ignore[arg-type]


@pytest.mark.parametrize("length", [0.0, 1e-45, 1e-40, 1e-20, 1e19, 1e300])
def test_as_given_to_a_scene(length: float) -> None:
    """Mesh.build normalises normals before it rounds them to float32, and replaces normals that have no direction."""
    assert MESH.normals is not None
    normals = MESH.normals.astype(np.float64)
    normals[::3] *= length
    mesh = Mesh.build(MESH.positions, MESH.triangles, normals)
    assert mesh.normals is not None
    assert np.linalg.norm(mesh.normals, axis=1) == pytest.approx(1, abs=2e-7)
    # A normal of length 0 is replaced by the mean of the faces' normals, which differs from the sphere's by some degrees.
    assert np.abs(mesh.normals - MESH.normals).max() <= (0.05 if length == 0 else 1e-6)


def test_normals_that_are_all_zero_are_no_normals() -> None:
    """Programs that know no normals write zeros. Such a mesh is drawn like one without normals."""
    assert Mesh.build(MESH.positions, MESH.triangles, np.zeros(MESH.positions.shape)).normals is None


@pytest.mark.parametrize("name", BRDFS)
def test_every_model_without_a_normal(name: str, renderer: Renderer) -> None:
    material = {"brdf": name}
    assert judge(with_lengths(0.0, 3, material), renderer).drawn > 500
    lit = judge(scene({**BALL, "material": material}, [SUN], camera=CAMERA), renderer)
    assert not lit.worst > WORST
