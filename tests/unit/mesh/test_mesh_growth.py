"""Growth: the time and the memory that a mesh takes to be made ready grow with its triangles, and no faster."""

from __future__ import annotations

import math
import time
import tracemalloc
from typing import Any

import numpy as np
import pytest

from glshade.mesh.facets import faceted
from glshade.mesh.mesh import Mesh
from glshade.mesh.normals import with_normals
from glshade.mesh.order import ordered
from glshade.mesh.tangents import with_tangents


def bumpy(side: int, uvs: bool = False, seed: int = 1) -> Mesh:
    """Returns a bumpy torus of 2 side^2 triangles, in an order without neighbours. seed: decides the order."""
    rng = np.random.default_rng(seed)
    u, v = np.meshgrid(np.arange(side), np.arange(side), indexing="ij")
    a, b = u * (2 * np.pi / side), v * (2 * np.pi / side)
    around = 2 + (1 + 0.1 * np.sin(9 * a)) * np.cos(b)
    positions = np.stack([around * np.cos(a), around * np.sin(a), np.sin(b)], axis=-1).reshape(-1, 3)
    here, right = (u * side + v).reshape(-1), ((u + 1) % side * side + v).reshape(-1)
    up, across = (u * side + (v + 1) % side).reshape(-1), ((u + 1) % side * side + (v + 1) % side).reshape(-1)
    triangles = np.vstack([np.stack([here, right, across], 1), np.stack([here, across, up], 1)])
    given = positions[:, :2] if uvs else None
    return Mesh.build(positions.astype(np.float32), triangles[rng.permutation(len(triangles))], uvs=given)


def smooth(mesh: Mesh) -> Any:
    assert mesh.is_solid
    return with_normals(ordered(mesh), "smooth", 40)


# What is made -> how many times the bytes of the given and the made mesh it may take besides.
STEPS = {
    "smooth": (smooth, 6),
    "faceted": (faceted, 3),
    "tangents": (lambda mesh: with_tangents(with_normals(mesh, "smooth", 40)), 8),
}


@pytest.mark.parametrize("step", STEPS)
def test_memory_is_a_few_times_that_of_the_arrays(step: str) -> None:
    make, times = STEPS[step]
    mesh = bumpy(256, uvs=step == "tangents")
    tracemalloc.start()
    try:
        made = make(mesh)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    # A block of triangles takes a few MB, however large the mesh is.
    assert peak < times * (mesh.nbytes + made.nbytes) + (12 << 20)


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
def test_time_grows_with_the_number_of_triangles(step: str) -> None:
    make, _ = STEPS[step]

    def seconds(side: int) -> float:
        taken = []
        for seed in range(2):
            # Another order of the triangles, so that nothing is known from an earlier mesh.
            mesh = bumpy(side, uvs=step == "tangents", seed=seed)
            begin = time.process_time()
            make(mesh)
            taken.append(time.process_time() - begin)
        return min(taken)

    # 36 times as many triangles. Caches that no longer hold the mesh account for the excess over 1.
    assert math.log(seconds(768) / seconds(128)) / math.log(36) < 1.3
