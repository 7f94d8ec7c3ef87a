"""Sampling: seeded distributions, which give single values of a scene another value in every sample.

A value depends on the seed, the key and the number of the sample alone. So sample 7 is the same on any machine, whatever was
drawn before it. Random numbers come from SHA-256, and not from a library whose streams may change with its version.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from glshade.document import Document, Finite, Vector3
from glshade.scene.override import apply

# A number, or a list of numbers that are drawn one by one.
Value = Finite | tuple[Finite, ...]
# The turn from one point of a Fibonacci spiral to the next: the golden angle (Swinbank and Purser 2006, equation 1) [radians].
GOLDEN = math.pi * (3 - math.sqrt(5))
KINDS = ("uniform", "log_uniform", "normal", "choice")


def unit_number(seed: int, key: str, number: int, part: int = 0) -> float:
    """Returns a number that is uniformly distributed in the open interval from 0 to 1.

    seed, key, number, part: different arguments give independent numbers.
    """
    digest = hashlib.sha256(f"{seed}\0{key}\0{number}\0{part}".encode()).digest()
    # A double has 53 bits. The half keeps 0 and 1 out, whose normal quantiles are infinite.
    return ((int.from_bytes(digest[:8], "big") >> 11) + 0.5) / 2**53


class Draw(Document):
    """A value of the scene that is drawn at random, by exactly one of the distributions."""

    key: str = Field(description='dotted key of the value, as for --set: "materials.body.roughness", "objects.ball.material"')
    uniform: tuple[Value, Value] | None = Field(None, description="the least and the largest value, or lists of them")
    log_uniform: tuple[Value, Value] | None = Field(
        None, description="the least and the largest value, above 0; the logarithm is uniform"
    )
    normal: tuple[Value, Value] | None = Field(None, description="the mean and the standard deviation")
    choice: tuple[Any, ...] | None = Field(
        None, description="any values, which are equally likely: numbers, presets, mesh files, lists of lights"
    )

    @classmethod
    def cross_faults(cls, data: Any) -> Iterable[tuple[tuple[str | int, ...], str]]:
        if not isinstance(data, Mapping):
            return
        given = [kind for kind in KINDS if data.get(kind) is not None]
        if len(given) != 1:
            yield (), f"needs exactly one of {', '.join(KINDS)}"
            return
        (kind,) = given
        values = data[kind]
        if not isinstance(values, list | tuple):
            return
        if kind == "choice":
            if not values:
                yield ("choice",), "is empty: there is nothing to choose from"
            return
        if len(values) != 2 or len({len(v) if isinstance(v, list | tuple) else 0 for v in values}) > 1:
            yield (kind,), "must be two numbers, or two lists of one length"
            return
        first, second = (v if isinstance(v, list | tuple) else [v] for v in values)
        for low, high in zip(first, second, strict=True):
            if not all(isinstance(x, int | float) for x in (low, high)):
                continue
            if kind == "normal" and high < 0:
                yield ("normal",), "the standard deviation must not be negative"
            if kind != "normal" and low > high:
                yield (kind,), f"the least value, {low}, exceeds the largest, {high}"
            if kind == "log_uniform" and low <= 0:
                yield ("log_uniform",), f"must be above 0, not {low}"

    def value(self, seed: int, number: int) -> Any:
        """Returns the value of a sample: a number, a list of numbers, or one of the choices."""
        if self.choice is not None:
            return self.choice[int(unit_number(seed, self.key, number) * len(self.choice))]
        first, second = self.uniform or self.log_uniform or self.normal or (0.0, 0.0)
        if isinstance(first, tuple) and isinstance(second, tuple):
            pairs = zip(first, second, strict=True)
            return [self._number(a, b, unit_number(seed, self.key, number, part)) for part, (a, b) in enumerate(pairs)]
        assert isinstance(first, float)
        assert isinstance(second, float)
        return self._number(first, second, unit_number(seed, self.key, number))

    def _number(self, first: float, second: float, u: float) -> float:
        """Returns the quantile u, from 0 to 1, of the distribution with two parameters."""
        if self.normal is not None:
            from statistics import NormalDist  # here, because it takes 5 ms to import

            return first + second * NormalDist().inv_cdf(u)
        if self.log_uniform is not None:
            return min(max(math.exp(math.log(first) + u * (math.log(second) - math.log(first))), first), second)
        return first + u * (second - first)


class Views(Document):
    """Places of the camera round a point."""

    on: Literal["sphere", "hemisphere"] = Field("sphere", description="hemisphere: the places with y above that of the target")
    pattern: Literal["uniform", "fibonacci", "stratified"] = Field(
        "uniform", description="fibonacci, stratified: the first `count` samples are spread evenly, and further ones start anew"
    )
    count: Annotated[int, Field(ge=1, le=10_000_000)] = Field(100, description="number of views of an even pattern")
    radius: tuple[Annotated[Finite, Field(gt=0)], Annotated[Finite, Field(gt=0)]] | None = Field(
        None, description="least and largest distance: a shell of equal density; left out: as near as shows the whole scene"
    )
    target: Vector3 = Field((0.0, 0.0, 0.0), description="point in the middle of the picture, if there is a radius")
    first: int = Field(1, description="number of the sample with which an even pattern begins")

    @classmethod
    def cross_faults(cls, data: Any) -> Iterable[tuple[tuple[str | int, ...], str]]:
        radius = data.get("radius") if isinstance(data, Mapping) else None
        numbers = [x for x in radius if isinstance(x, int | float)] if isinstance(radius, list | tuple) else []
        if len(numbers) == 2 and numbers[0] > numbers[1]:
            yield ("radius",), f"the least distance, {numbers[0]}, exceeds the largest, {numbers[1]}"

    def values(self, seed: int, number: int) -> dict[str, Any]:
        """Returns the values of the camera in a sample, by their dotted keys."""
        direction = self.direction(seed, number)
        if self.radius is None:
            # The matrix tells the direction of view alone: fit moves the eye.
            pose = np.eye(4)
            right = np.cross((0.0, 1.0, 0.0), direction)
            right = right / np.linalg.norm(right) if right.any() else np.array([1.0, 0.0, 0.0])
            pose[:3, :3] = np.stack([right, np.cross(direction, right), direction], axis=1)
            return {"camera.eye": None, "camera.target": None, "camera.matrix": pose.tolist(), "camera.fit": True}
        low, high = self.radius
        # The volume within a radius grows with its cube.
        cube = low**3 + unit_number(seed, "camera.radius", number) * (high**3 - low**3)
        eye = np.array(self.target) + direction * min(max(cube ** (1 / 3), low), high)
        return {"camera.eye": eye.tolist(), "camera.target": list(self.target), "camera.matrix": None, "camera.fit": False}

    def direction(self, seed: int, number: int) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Returns the unit direction (3,) from the target to the eye.

        The height of a point on a sphere is uniformly distributed (Archimedes), and its angle about the axis is, too.
        """
        index = (number - self.first) % self.count
        height, angle = (unit_number(seed, "camera.eye", number, part) for part in range(2))
        if self.pattern == "fibonacci":
            height, angle = (index + 0.5) / self.count, index * GOLDEN / (2 * math.pi) % 1.0
        elif self.pattern == "stratified":
            height, angle = self._stratum(index, height, angle)
        y = height if self.on == "hemisphere" else 2 * height - 1
        across = math.sqrt(max(1 - y * y, 0.0))
        return np.array([across * math.sin(2 * math.pi * angle), y, across * math.cos(2 * math.pi * angle)])

    def _stratum(self, index: int, u: float, v: float) -> tuple[float, float]:
        """Returns a point (height, angle), from 0 to 1 each, in one of `count` cells of equal area.

        The cells lie in rows whose numbers of cells differ by at most one. Each row is as high as it has cells.
        """
        rows = max(1, round(math.sqrt(self.count / 2)))
        row = index * rows // self.count
        begin, end = -(-row * self.count // rows), -(-(row + 1) * self.count // rows)
        return (begin + u * (end - begin)) / self.count, (index - begin + v) / (end - begin)


class Sample(Document):
    """Values that are drawn at random, anew in each frame: frame n is sample n."""

    seed: int = Field(0, description="another seed gives other samples")
    values: tuple[Draw, ...] = Field((), description="values that are drawn")
    views: Views | None = Field(None, description="places of the camera; left out: the camera stays where it is")

    def drawn(self, number: int) -> dict[str, Any]:
        """Returns the values of a sample, by their dotted keys."""
        return dict(self._drawn(number))

    def _drawn(self, number: int) -> Iterator[tuple[str, Any]]:
        if self.views is not None:
            yield from self.views.values(self.seed, number).items()
        for draw in self.values:
            yield draw.key, draw.value(self.seed, number)


def at_sample(document: Mapping[str, Any], sample: Sample, number: int) -> dict[str, Any]:
    """Returns a copy of the document with the values of a sample. A value that is None is left out of the document.

    Errors: OverrideError for a key that names no value of the document.
    """
    result = dict(document)
    for key, value in sample.drawn(number).items():
        result = apply(result, key, value)
    return result
