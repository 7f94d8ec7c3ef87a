"""The float64 reference agrees with a ray tracer that shares no code with it.

The scenes are made at random. At each pixel that is farther than 1/50 pixel from any edge, the two pictures differ by at most
1e-6 of the picture's brightest value, or 1e-3 where lights of opposite sign may cancel.
"""

from __future__ import annotations

import json
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from support.opinions import agreement
from support.third.generator import Generator

COUNT = 100


def prove(count: int, seed: int) -> int:
    """Compares the two pictures of `count` scenes, and returns the number of scenes where they differ."""
    found = []
    with TemporaryDirectory() as folder:
        for number in range(count):
            scene = Generator(Path(folder), seed, number).scene()
            result = agreement(scene)
            found.append(result)
            if not result.holds:
                print(f"scene {number}: {result.worst:.1e} of the brightest value at pixel {result.place}: {json.dumps(scene)}")
    worst = sorted(result.worst for result in found)
    print(f"largest difference: median {np.median(worst):.1e}, worst {worst[-1]:.1e} of the picture's brightest value")
    print(f"pixels that are compared: {np.mean([result.compared for result in found]):.1%}")
    return sum(not result.holds for result in found)
