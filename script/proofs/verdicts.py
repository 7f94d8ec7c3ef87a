"""No right picture fails: scenes whose meshes reach over the picture's border are never judged "failed" on the driver at hand.

Each scene has one to three shapes of the default resolution, each with one of ten materials and one rate, one to three lights,
and a camera so near that most shapes cross the border of the picture of 320 x 240 pixels. A failed scene is written to
out/prove/verdicts/SEED-INDEX.json, from where `glshade verify` reads it.
"""

from __future__ import annotations

import json
import math
import os
from collections import Counter
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

import glshade
from glshade.brdfs import BRDFS

COUNT = 5000
SIZE = (320, 240)
SHAPES = ("sphere", "icosphere", "cube", "plane", "torus", "cylinder", "cone")
MATERIALS = (
    "ashikhmin_shirley",
    "beckmann",
    "blinn_phong",
    "burley",
    "ggx",
    "lambert",
    "oren_nayar",
    "phong",
    "principled",
    "ward",
)
RATES = ("flat", "gouraud", "phong")
FOLDER = Path(__file__).resolve().parents[2] / "out" / "prove" / "verdicts"


def prove(count: int, seed: int) -> int:
    """Verifies `count` scenes, prints the failed ones and a summary, and returns the number of failed ones."""
    verdicts: Counter[str] = Counter()
    used = []
    with get_context("spawn").Pool(os.cpu_count()) as pool:
        results = pool.imap_unordered(judged, ((seed, index) for index in range(count)))
        for number, (index, verdict, share) in enumerate(results, start=1):
            verdicts[verdict] += 1
            used.append(share)
            if verdict == "failed":
                print(f"scene {index} fails, {share:.3g} times its tolerance: {written(seed, index)}", flush=True)
            if number % 500 == 0:
                print(f"{number} scenes, {verdicts['failed']} failed", flush=True)
    print(", ".join(f"{verdicts[verdict]} {verdict}" for verdict in ("verified", "inconclusive", "failed")))
    print(
        f"largest share of its tolerance that a pixel of a scene uses: median {np.median(used):.3f}, "
        f"p99 {np.quantile(used, 0.99):.3f}, max {max(used):.3f}"
    )
    return verdicts["failed"]


def judged(case: tuple[int, int]) -> tuple[int, str, float]:
    """Returns (index, verdict, the largest ratio of a pixel's error to its tolerance) of the scene of a pair (seed, index)."""
    verdict = glshade.verify(glshade.Scene.model_validate(scene_of(*case)), renderer=renderer())
    return case[1], verdict.verdict, verdict.used


@cache
def renderer() -> glshade.Renderer:
    """Returns the renderer of this process."""
    return glshade.Renderer()


def written(seed: int, index: int) -> Path:
    """Writes a scene as JSON and returns the path of the file."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    path = FOLDER / f"{seed}-{index}.json"
    path.write_text(json.dumps(scene_of(seed, index), indent=1) + "\n")
    return path


def scene_of(seed: int, index: int) -> dict[str, Any]:
    """Returns the scene with this index as a document that JSON can hold."""
    random = np.random.default_rng((seed, index))
    return {
        "film": {"size": SIZE},
        "camera": camera(random),
        "objects": [thing(random) for _ in range(random.integers(1, 4))],
        "lights": [light(random) for _ in range(random.integers(1, 4))],
    }


def camera(random: np.random.Generator) -> dict[str, Any]:
    """Returns a camera that sees the middle of the scene, but not all of it."""
    eye = random.normal(size=3)
    eye *= random.uniform(3, 6) / np.linalg.norm(eye)
    view = {"eye": eye.round(3).tolist(), "target": random.uniform(-0.3, 0.3, 3).round(3).tolist()}
    if random.random() < 0.2:
        return {"type": "orthographic", "height": random.uniform(1, 3), **view}
    return {"type": "perspective", "fov": random.uniform(15, 40), **view}


def thing(random: np.random.Generator) -> dict[str, Any]:
    """Returns an object near the middle of the scene."""
    return {
        "shape": {"type": str(random.choice(SHAPES))},
        "transform": {
            "translate": random.uniform(-1, 1, 3).round(2).tolist(),
            "rotate": random.uniform(-180, 180, 3).round(1).tolist(),
            "scale": random.uniform(0.5, 1.5, 3).round(2).tolist(),
        },
        "material": material(random),
        "shading": str(random.choice(RATES)),
    }


def material(random: np.random.Generator) -> dict[str, Any]:
    """Returns a material whose parameters are within their usual ranges."""
    name = str(random.choice(MATERIALS))
    model = BRDFS[name]
    values: dict[str, Any] = {"brdf": name}
    for key, declared in model.parameters().items():
        low, high = declared.usual
        if model.is_colour(key):
            values[key] = random.uniform(low, high, 3).tolist()
        elif low > 0 and high > 10 * low:
            # Exponents and widths span decades, of which each is equally likely.
            values[key] = math.exp(random.uniform(math.log(low), math.log(high)))
        else:
            values[key] = random.uniform(low, high)
    return values


def light(random: np.random.Generator) -> dict[str, Any]:
    """Returns a directional, point or spot light that shines on the middle of the scene."""
    kind = str(random.choice(["directional", "point", "spot"]))
    place = random.normal(size=3)
    place *= random.uniform(2.5, 6) / np.linalg.norm(place)
    values: dict[str, Any] = {"type": kind, "colour": random.uniform(0.2, 1, 3).round(2).tolist()}
    if kind == "directional":
        return {**values, "direction": (-place).tolist(), "intensity": random.uniform(1, 3)}
    falloff = str(random.choice(["none", "1/r", "1/r^2"]))
    values |= {
        "position": place.tolist(),
        "falloff": falloff,
        "intensity": random.uniform(1, 3) * (1 if falloff == "none" else 5),
    }
    if kind == "spot":
        outer = random.uniform(10, 60)
        values |= {"direction": (-place).tolist(), "outer": outer, "inner": outer * random.random()}
    return values
