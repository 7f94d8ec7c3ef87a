"""Growth: measures how the time of a frame grows with the contents of its scene, as the exponent of a power law."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from itertools import islice
from statistics import median
from typing import Any

import numpy as np

from glshade.bench.entrants import FRAMES
from glshade.bench.stage import DISTANCE, EXPONENT, EYE, FAR, FOV, KD, KS, NEAR, TO_LIGHT
from glshade.bench.worker import draws
from glshade.driver.clock import Spread
from glshade.gl.renderer import Renderer
from glshade.mesh.primitives import icosphere
from glshade.scene.scene import Scene

# Largest exponent that counts as near linear: with it, twice as many contents take 2.14 times as long.
NEAR_LINEAR = 1.1
# Largest time that one more object may add to a frame [s].
AN_OBJECT = 30e-6
# Default width and height of the pictures [pixels].
SIDE = 512
MATERIAL = {"brdf": "phong", "kd": list(KD), "ks": KS, "exponent": EXPONENT}
SUN = {"type": "directional", "direction": [-x for x in TO_LIGHT]}


def triangles(subdivisions: int) -> tuple[int, Scene]:
    """Returns the number of triangles, and a scene with one sphere."""
    return 20 * 4**subdivisions, _scene([_sphere(subdivisions)])


def lights(count: int) -> tuple[int, Scene]:
    """Returns the number of lights, and a scene with point lights on a circle before a sphere. Intensities add up to 1."""
    turns = 2 * np.pi * np.arange(count) / count
    places = np.stack([3 * np.cos(turns), 3 * np.sin(turns), np.full(count, 2.0)], axis=1)
    lamps = [{"type": "point", "position": p, "intensity": 1 / count, "falloff": "none"} for p in places.tolist()]
    return count, _scene([_sphere(5)], lights=lamps)


def pixels(side: int) -> tuple[int, Scene]:
    """Returns the number of pixels, and a scene with one sphere in a picture of this width and height [pixels]."""
    return side**2, _scene([_sphere(5)], side=side)


def objects(count: int) -> tuple[int, Scene]:
    """Returns the number of objects, and a scene with small spheres in a square, which share one mesh and one material."""
    across = int(np.ceil(np.sqrt(count)))
    places = (np.stack(np.unravel_index(np.arange(count), (across, across)), axis=1) + 0.5) / across * 2 - 1
    radius = 0.8 / across
    return count, _scene([{**_sphere(1), "transform": {"translate": [*p, 0], "scale": radius}} for p in places.tolist()])


# Name of a series -> (function that makes a scene, its argument for each scene). A series has fewer scenes than a renderer's
# cache holds.
SERIES: Mapping[str, tuple[Callable[[int], tuple[int, Scene]], tuple[int, ...]]] = {
    "triangles": (triangles, (3, 4, 5, 6, 7, 8)),
    "lights": (lights, (1, 2, 4, 8, 16, 32, 64)),
    "pixels": (pixels, (128, 256, 512, 1024, 2048, 4096)),
    "objects": (objects, (1, 10, 100, 1000, 10_000)),
}


@dataclass(frozen=True)
class Growth:
    """The measurements of one series.

    what: name of the series, as in SERIES
    sizes: number of triangles, lights, pixels or objects of each scene, ascending
    seconds: time of a frame of each scene, with its readback [s]
    """

    what: str
    sizes: tuple[int, ...]
    seconds: tuple[Spread, ...]

    @property
    def exponent(self) -> float:
        """The exponent of the power law fitted to all sizes."""
        return fitted(self.sizes, [spread.median for spread in self.seconds])

    @property
    def at_the_end(self) -> float:
        """The exponent between the last two sizes, where the fixed cost of a frame matters least."""
        return fitted(self.sizes[-2:], [spread.median for spread in self.seconds[-2:]])

    @property
    def each(self) -> float:
        """The time that one more triangle, light, pixel or object adds, between the first and the last size [s]."""
        return (self.seconds[-1].median - self.seconds[0].median) / (self.sizes[-1] - self.sizes[0])

    @property
    def met(self) -> bool:
        """Whether the targets are met: both exponents are at most NEAR_LINEAR, and one more object takes at most AN_OBJECT."""
        cheap = self.what != "objects" or self.each <= AN_OBJECT
        return cheap and max(self.exponent, self.at_the_end) <= NEAR_LINEAR

    def as_dict(self) -> dict[str, Any]:
        """Returns the measurements as JSON types."""
        rows = [{"size": size, "seconds": spread.as_dict()} for size, spread in zip(self.sizes, self.seconds, strict=True)]
        figures = {"exponent": self.exponent, "exponent_at_the_end": self.at_the_end, "seconds_each": self.each}
        rounded = {name: float(f"{value:.4g}") for name, value in figures.items()}
        limits = {"target": NEAR_LINEAR} | ({"target_each": AN_OBJECT} if self.what == "objects" else {})
        return {"what": self.what, **rounded, **limits, "met": self.met, "rows": rows}


def fitted(sizes: Sequence[float], seconds: Sequence[float]) -> float:
    """Returns the exponent p of the power law c n^p for the time at the size n, fitted by least squares of the logarithms."""
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])


def measure_growth(what: str, repeat: int, small: bool = False) -> Growth:
    """Measures the scenes of a series in turn, in wall-clock time.

    what: name of the series, as in SERIES
    repeat: number of rounds that are counted
    small: True measures only the first three scenes, to see that it works
    Errors: KeyError for an unknown series; ContextError.
    """
    make, steps = SERIES[what]
    scenes = [make(step) for step in (islice(steps, 3) if small else steps)]
    times: list[list[float]] = [[] for _ in scenes]
    with Renderer() as renderer:
        # The first round is not counted, because the renderer compiles programs and uploads meshes in it.
        for turn in range(repeat + 1):
            for (_, scene), rounds in zip(scenes, times, strict=True):
                seconds = median(draws(partial(renderer.render, scene), FRAMES))
                if turn:
                    rounds.append(seconds)
    return Growth(what, tuple(size for size, _ in scenes), tuple(map(Spread.of, times)))


def _sphere(subdivisions: int) -> dict[str, Any]:
    return {"mesh": _icosphere(subdivisions), "material": MATERIAL}


# Cached, so that thousands of objects share one mesh.
_icosphere = cache(icosphere)


def _scene(things: list[dict[str, Any]], lights: list[dict[str, Any]] | None = None, side: int = SIDE) -> Scene:
    camera = {"eye": EYE, "target": (0, 0, 0), "fov": FOV, "near": NEAR, "far": FAR + DISTANCE}
    film = {"size": (side, side), "encoding": "linear"}
    return Scene.model_validate({"objects": things, "lights": lights or [SUN], "camera": camera, "film": film})
