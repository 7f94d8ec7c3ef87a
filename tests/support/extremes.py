"""Extreme materials and directions, and the error that a model may have there.

tests/contracts/test_extremes_*.py and docs/accuracy.md use them. The error is measured in units of the conditioning. To compute
the conditioning, each input (the components of l, v and n, and every parameter) is perturbed by the rounding error of float32,
and the absolute changes of the float64 value are summed. The rounding error of the result is added. No float32 program can be
expected to have a smaller error.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from glshade import BRDFS, Renderer, evaluate
from glshade.arrays import rounded
from glshade.brdfs import Brdf, Parameter
from glshade.glsl.uniforms import parameter_values

Array = NDArray[np.float64]
Stage = Literal["vertex", "fragment"]
STAGES: tuple[Stage, ...] = ("vertex", "fragment")

# The largest relative error of rounding to float32.
ROUNDING = 2.0**-24
# The angle by which rounding its components tilts a unit normal about either tangent: half an ulp of a number below 1 [rad].
TILT = 2.0**-25
# The smallest normal float32. Fragment stages flush smaller numbers to 0, products included.
TINY = 2.0**-126
# The error that is allowed at ordinary parameters, relative to max(1, |f cos|).
ORDINARY = 2e-6
# The error that is allowed at extremes, in units of the conditioning.
FACTOR = 4.0
# Parameters without an upper bound are tried up to this value.
STRONG = 1e3
# Scalars that reach this value, such as exponents, are tried at every power of ten.
WIDE = 1e3


def walk(declared: Parameter) -> list[float]:
    """Returns the values at which a scalar is tried: its bounds, the ends of its usual range, 1e-4, 1e-3, 1, and powers of ten
    up to 1e8 for exponents."""
    high = STRONG if declared.high is None else declared.high
    found = {declared.low, high, *declared.usual, 1e-4, 1e-3, 1.0}
    if high >= WIDE:
        found |= {10.0**k for k in range(9)}
    return sorted({min(max(float(np.float32(x)), declared.low), high) for x in found if declared.low <= x <= high})


def at_extremes(name: str, most: int) -> list[Brdf]:
    """Returns materials of a model whose scalars take the values of `walk`.

    First each scalar takes every value of `walk` in turn. Then all scalars take random values of `walk`, until there are `most`
    materials. The colours are at the ends of their ranges. The random materials are the same in every run, and a smaller `most`
    gives the beginning of the same list.
    """
    model, random = BRDFS[name], np.random.default_rng(1)
    declared = model.parameters()
    scalars = {key: walk(d) for key, d in declared.items() if not model.is_colour(key)}
    bright: dict[str, Any] = {}
    for key in (key for key in declared if model.is_colour(key)):
        high = declared[key].high
        # The colour is not grey, so that the tests notice a model that mixes up channels.
        bright[key] = tuple(x * (1.0 if high is None else high) for x in (1.0, 0.75, 0.5))
    found = [model(**bright, **chosen) for chosen in choices(model)]
    found += [model(**{key: declared[key].low for key in bright})]
    found += [model(**{**bright, key: declared[key].low}) for key in bright]
    found += [model(**bright, **{key: x}) for key, places in scalars.items() for x in places]
    if len(scalars) <= 4:
        # Pairs of scalars: opposite ends of their ranges, and ratios of 1e6.
        for one, other in itertools.permutations(scalars, 2):
            ends = [(scalars[one][0], scalars[other][-1])]
            ends += [(1.0, 1e6), (100.0, 1e8)] if {1.0, 1e6, 1e8} <= set(scalars[one]) & set(scalars[other]) else []
            found += [model(**bright, **{one: x, other: y}) for x, y in ends]
    if len(scalars) > 1:
        combinations = math.prod(map(len, scalars.values()))
        for _ in range(min(most, combinations) - len(found)):
            values = {key: float(random.choice(places)) for key, places in scalars.items()}
            found.append(model(**bright, **values, **choices(model)[random.integers(len(choices(model)))]))
    return found


def spread(found: list[Brdf], most: int) -> list[Brdf]:
    """Returns at most `most` of the materials, at even distances in the list."""
    return found[:: math.ceil(len(found) / most)]


def choices(model: type[Brdf]) -> list[dict[str, str]]:
    """Returns every combination of the model's options."""
    options = [[(key, value) for value in get_args(model.model_fields[key].annotation)] for key in model.choices()]
    return [dict(chosen) for chosen in itertools.product(*options)]


def ordinary(name: str, count: int) -> list[Brdf]:
    """Returns `count` random materials within the usual ranges, the same in every run. Ranges of more than a decade are sampled
    logarithmically."""
    model, random = BRDFS[name], np.random.default_rng(1)
    found = []
    for _ in range(count):
        values: dict[str, Any] = {}
        for key, declared in model.parameters().items():
            low, high = declared.usual
            share = random.uniform(size=3)
            x = low * (high / low) ** share if low > 0 and high > 10 * low else low + (high - low) * share
            values[key] = tuple(map(float, x)) if model.is_colour(key) else float(x[0])
        found.append(model(**values, **choices(model)[random.integers(len(choices(model)))]))
    return found


def unit(x: Any) -> NDArray[np.float32]:
    """Returns the vectors x (..., 3), of any leading shape, made unit and rounded to float32."""
    x = np.asarray(x, dtype=np.float64)
    return (x / np.linalg.norm(x, axis=-1, keepdims=True)).astype(np.float32)


MIRROR = np.float32([-1, -1, 1])


def upward(count: int, seed: int) -> Array:
    """Returns random unit directions (count, 3) of the upper hemisphere."""
    d = np.random.default_rng(seed).normal(size=(count, 3))
    d[:, 2] = np.abs(d[:, 2])
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def at_height(z: Any, azimuth: Any) -> NDArray[np.float32]:
    """Returns unit directions (..., 3) whose z is exactly `z`. z and azimuth [rad] broadcast to the leading shape."""
    z, azimuth = np.broadcast_arrays(np.asarray(z, dtype=np.float64), np.asarray(azimuth, dtype=np.float64))
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(azimuth), r * np.sin(azimuth), z], axis=-1).astype(np.float32)


def around(d: Any, offset: Array, seed: int) -> NDArray[np.float32]:
    """Returns the directions d (N, 3), turned to a random side by the angles `offset` (N,) [rad]."""
    side = np.random.default_rng(seed).normal(size=np.shape(d))
    side -= d * np.sum(side * d, axis=1, keepdims=True)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    return unit(d + offset[:, None] * side)


Pairs = tuple[NDArray[np.float32], NDArray[np.float32]]


def pairs() -> dict[str, Pairs]:
    """Returns, by the name of the case, pairs of directions l, v (N, 3) at which a model may fail."""
    n = np.float32([0, 0, 1])
    some = unit(upward(64, 1))
    azimuth = np.linspace(0.1, 6.2, 8)
    level = at_height(0.0, azimuth)
    scales = 10.0 ** -np.arange(0.0, 8.0)
    found: dict[str, Pairs] = {}
    found["anywhere"] = (unit(upward(256, 2)), unit(upward(256, 3)))
    found["l = v"] = (np.concatenate([some, [n]]), np.concatenate([some, [n]]))
    found["l = -v"] = (np.concatenate([some, -some, level, [n]]), -np.concatenate([some, -some, level, [n]]))
    found["h = n"] = (np.concatenate([some, [n]]), np.concatenate([some * MIRROR, [n]]))
    # The half vector, or the mirror direction, turns away by every angle at which a lobe may have its edge.
    near = np.repeat(unit(upward(48, 4)), len(scales), axis=0)
    turn = np.tile(scales, 48) * np.random.default_rng(5).uniform(0.3, 3, len(near))
    found["near the mirror direction"] = (near, around(near * MIRROR, turn, 6))
    found["l near v"] = (near, around(near, turn, 7))
    found["both near n"] = (around(np.tile(n, (len(near), 1)), turn, 8), around(np.tile(n, (len(near), 1)), turn[::-1], 9))
    one = np.repeat(some[:8], 8, axis=0)
    found["l in the horizon"] = (np.tile(level, (8, 1)), one)
    found["v in the horizon"] = (one, np.tile(level, (8, 1)))
    found["both in the horizon"] = (np.repeat(level, 8, axis=0), np.tile(level, (8, 1)))
    for z in (1e-7, 1e-4, 1e-30):
        above = at_height(z, azimuth)
        found[f"l {z:g} above the horizon"] = (np.tile(above, (8, 1)), one)
        found[f"v {z:g} above the horizon"] = (one, np.tile(above, (8, 1)))
        found[f"both {z:g} above the horizon"] = (np.repeat(above, 8, axis=0), np.tile(above * MIRROR, (8, 1)))
        found[f"l {z:g} below the horizon"] = (np.tile(-above, (8, 1)), one)
        found[f"v {z:g} below the horizon"] = (one, np.tile(-above, (8, 1)))
    return {case: (l.astype(np.float32), v.astype(np.float32)) for case, (l, v) in found.items()}


def joined(cases: dict[str, Pairs]) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.str_]]:
    """Returns l and v (N, 3) of all cases, one after another, and the name of each row's case (N,)."""
    l, v = (np.concatenate([pair[i] for pair in cases.values()]) for i in (0, 1))
    return l, v, np.repeat(list(cases), [len(pair[0]) for pair in cases.values()])


def exact(material: Brdf, l: Any, v: Any) -> tuple[Array, Array]:
    """Returns (value, conditioning), each (N, 3): the float64 value of f cos at float32 inputs, and its conditioning [1/sr]."""
    value, inputs, tilt = conditions(material, l, v)
    return value, inputs + tilt


def conditions(material: Brdf, l: Any, v: Any) -> tuple[Array, Array, Array]:
    """Returns (value, inputs, tilt), each (N, 3) [1/sr]: the float64 value of f cos at float32 inputs, and the two parts of its
    conditioning.

    inputs is the change of the value when l, v, the parameters and the result are rounded. tilt is its change when the normal
    is rounded.
    """
    parameters = {name: rounded(x).astype(np.float64) for name, x in parameter_values(material).items()}
    fixed = {**material.chosen(), **material.data()}

    def f(l: Array, v: Array, given: dict[str, Array] = parameters) -> Array:
        value: Array = type(material).brdf_cos(SimpleNamespace(**given, **fixed), l, v)
        return np.broadcast_to(value, l.shape)

    l, v = np.asarray(l, dtype=np.float64), np.asarray(v, dtype=np.float64)
    value = f(l, v)

    def reach(others: Iterable[Array]) -> Array:
        result: Array = np.maximum.reduce([np.abs(other - value) for other in others])
        return result

    inputs = ROUNDING * np.abs(value)
    for axis in range(3):
        step = np.zeros(3)
        step[axis] = ROUNDING
        inputs = inputs + reach(f(l * (1 + s), v) for s in (step, -step)) + reach(f(l, v * (1 + s)) for s in (step, -step))
    for name, x in parameters.items():
        # The number 0 is exact.
        if np.any(x):
            inputs = inputs + reach(f(l, v, {**parameters, name: x * (1 + s)}) for s in (ROUNDING, -ROUNDING))
    # Tilting the normal has the same effect as turning both directions: to the four sides, and to the four diagonals.
    tilts = [(x, y) for x, y in itertools.product((-TILT, 0.0, TILT), repeat=2) if x or y]
    return value, inputs, reach(f(_turned(l, x, y), _turned(v, x, y)) for x, y in tilts)


def _turned(d: Array, x: float, y: float) -> Array:
    """Returns the directions d (N, 3), turned by the small angles x toward the first axis and y toward the second [rad]."""
    return np.stack([d[:, 0] - x * d[:, 2], d[:, 1] - y * d[:, 2], d[:, 2] + x * d[:, 0] + y * d[:, 1]], axis=1)


@dataclass
class Worst:
    """The largest value seen so far.

    value: the largest value.
    place: a description of the material and the directions that gave it.
    """

    value: float = 0.0
    place: str = ""

    def add(self, values: Array, describe: Any) -> None:
        """Takes values (N, 3) into account. describe(i) describes row i."""
        highest = values.max(axis=-1)
        # A NaN counts as the largest value.
        index = int(np.argmax(np.where(np.isnan(highest), np.inf, highest)))
        if not highest[index] <= self.value:
            self.value, self.place = float(highest[index]), describe(index)


def relative(gpu: Any, value: Array) -> Array:
    """Returns the error relative to max(1, |f cos|)."""
    result: Array = np.abs(gpu - value) / np.maximum(1, np.abs(value))
    return result


def in_conditioning(gpu: Any, value: Array, conditioning: Array) -> Array:
    """Returns the error in units of the conditioning. Errors below the smallest normal float32 do not count."""
    result: Array = np.maximum(np.abs(gpu - value) - TINY, 0) / (conditioning + TINY)
    return result


def measured(material: Brdf, stage: Stage, renderer: Renderer, l: Any, v: Any) -> NDArray[np.float32]:
    """Returns f cos (N, 3) as a shader stage on the GPU computes it [1/sr]. Errors: AssertionError if a value is not finite."""
    gpu = evaluate(material, l, v, on=stage, context=renderer.context)
    bad = np.flatnonzero(~np.isfinite(gpu).all(axis=1))
    assert not len(bad), f"{material!r}: {gpu[bad[0]]} at l {l[bad[0]]}, v {v[bad[0]]}"
    return gpu
