"""The verifier finds every sabotage: each small fault in the GLSL fails, or changes no value of the picture by more than 5e-6.

The sabotages and their scenes are those of tests/support/sabotage.py.
"""

from __future__ import annotations

import numpy as np
from support.sabotage import SABOTAGES, Saboteur

import glshade

COUNT = len(SABOTAGES)


def prove(count: int, seed: int) -> int:
    """Tries `count` sabotages, prints those that the verifier misses, and returns their number."""
    chosen = np.random.default_rng(seed).permutation(COUNT)[:count]
    with glshade.Renderer() as renderer:
        faults = Saboteur(renderer).faults(SABOTAGES[index] for index in chosen)
    for fault in faults:
        print(f"missed: {fault}")
    return len(faults)
