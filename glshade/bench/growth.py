"""Growth: how the time of a frame grows with what is in it, as an exponent: 1 is in proportion, 2 its square."""

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

# The most that an exponent may be: twice as much takes at most 2.2 times as long.
NEAR_LINEAR = 1.15
# The most that an object may add to a frame [s].
AN_OBJECT = 30e-6
SIDE = 512
MATERIAL = {"brdf": "phong", "kd": list(KD), "ks": KS, "exponent": EXPONENT}
SUN = {"type": "directional", "direction": [-x for x in TO_LIGHT]}


def triangles(subdivisions: int) -> tuple[int, Scene]:
    """One sphere."""
    return 20 * 4**subdivisions, _scene([_sphere(subdivisions)])


def lights(count: int) -> tuple[int, Scene]:
    """Point lights on a circle before the sphere, together as bright as one."""
    turns = 2 * np.pi * np.arange(count) / count
    places = np.stack([3 * np.cos(turns), 3 * np.sin(turns), np.full(count, 2.0)], axis=1)
    lamps = [{"type": "point", "position": p, "intensity": 1 / count, "falloff": "none"} for p in places.tolist()]
    return count, _scene([_sphere(5)], lights=lamps)


def pixels(side: int) -> tuple[int, Scene]:
    """The same view, finer."""
    return side**2, _scene([_sphere(5)], side=side)


def objects(count: int) -> tuple[int, Scene]:
    """Small spheres of one mesh and one material in a square before the camera."""
    across = int(np.ceil(np.sqrt(count)))
    places = (np.stack(np.unravel_index(np.arange(count), (across, across)), axis=1) + 0.5) / across * 2 - 1
    radius = 0.8 / across
    return count, _scene([{**_sphere(1), "transform": {"translate": [*p, 0], "scale": radius}} for p in places.tolist()])


# What grows: how to make a scene, and of what sizes. Fewer than the scenes that a renderer keeps ready.
SERIES: Mapping[str, tuple[Callable[[int], tuple[int, Scene]], tuple[int, ...]]] = {
    "triangles": (triangles, (3, 4, 5, 6, 7, 8)),
    "lights": (lights, (1, 2, 4, 8, 16, 32, 64)),
    "pixels": (pixels, (128, 256, 512, 1024, 2048, 4096)),
    "objects": (objects, (1, 10, 100, 1000, 10_000)),
}


@dataclass(frozen=True)
class Growth:
    """A series. sizes: ascending; seconds: of a frame at each, read back."""

    what: str
    sizes: tuple[int, ...]
    seconds: tuple[Spread, ...]

    @property
    def exponent(self) -> float:
        """Of the power law nearest to all of them."""
        return fitted(self.sizes, [spread.median for spread in self.seconds])

    @property
    def at_the_end(self) -> float:
        """From the last but one to the last, where what every frame costs weighs least."""
        return fitted(self.sizes[-2:], [spread.median for spread in self.seconds[-2:]])

    @property
    def each(self) -> float:
        """What one more costs, between the ends [s]."""
        return (self.seconds[-1].median - self.seconds[0].median) / (self.sizes[-1] - self.sizes[0])

    @property
    def met(self) -> bool:
        """Near linear, or less; of objects also cheap enough each."""
        cheap = self.what != "objects" or self.each <= AN_OBJECT
        return cheap and max(self.exponent, self.at_the_end) <= NEAR_LINEAR

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        rows = [{"size": size, "seconds": spread.as_dict()} for size, spread in zip(self.sizes, self.seconds, strict=True)]
        figures = {"exponent": self.exponent, "exponent_at_the_end": self.at_the_end, "seconds_each": self.each}
        rounded = {name: float(f"{value:.4g}") for name, value in figures.items()}
        limits = {"target": NEAR_LINEAR} | ({"target_each": AN_OBJECT} if self.what == "objects" else {})
        return {"what": self.what, **rounded, **limits, "met": self.met, "rows": rows}


def fitted(sizes: Sequence[float], seconds: Sequence[float]) -> float:
    """The exponent p of the c n^p that is nearest, by least squares of the logarithms."""
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])


def growth(what: str, repeat: int, small: bool = False) -> Growth:
    """Measures a series by the clock on the wall, its sizes in turn; small: the first three of them, in few pixels.

    Errors: KeyError, ContextError.
    """
    make, steps = SERIES[what]
    made = [make(step) for step in (islice(steps, 3) if small else steps)]
    took: list[list[float]] = [[] for _ in made]
    with Renderer() as renderer:
        # The first round compiles and uploads.
        for turn in range(repeat + 1):
            for (_, scene), found in zip(made, took, strict=True):
                seconds = median(draws(partial(renderer.render, scene), FRAMES))
                if turn:
                    found.append(seconds)
    return Growth(what, tuple(size for size, _ in made), tuple(map(Spread.of, took)))


def _sphere(subdivisions: int) -> dict[str, Any]:
    return {"mesh": _icosphere(subdivisions), "material": MATERIAL}


# One mesh, not thousands of equal ones.
_icosphere = cache(icosphere)


def _scene(things: list[dict[str, Any]], lights: list[dict[str, Any]] | None = None, side: int = SIDE) -> Scene:
    camera = {"eye": EYE, "target": (0, 0, 0), "fov": FOV, "near": NEAR, "far": FAR + DISTANCE}
    film = {"size": (side, side), "encoding": "linear"}
    return Scene.model_validate({"objects": things, "lights": lights or [SUN], "camera": camera, "film": film})
