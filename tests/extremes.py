"""Where the models are pushed to, and how wrong they may be there: for tests/contracts/test_extremes_*.py and docs/accuracy.md.

The measure is the problem's own conditioning: how far the float64 value moves when each input (the components of l, v and n,
every parameter) is rounded to float32, the sizes of the moves added up, and the rounding of the result itself with them. No
float32 program can be asked for less; one that stays within K times of it has lost nothing that was there.
"""

from __future__ import annotations

import itertools
import math
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

# Half an ulp, relative to the largest number of a binade: what rounding to float32 does at worst.
ROUNDING = 2.0**-24
# How far the rounding of its components tilts a unit normal, about either axis of its plane: half an ulp below 1 [rad].
TILT = 2.0**-25
# The smallest normal float32. Fragment stages flush what is below, and a product of such numbers with it.
TINY = 2.0**-126
# Ordinary parameters: the error relative to max(1, |f cos|).
ORDINARY = 2e-6
# Extremes: the error in units of the conditioning.
FACTOR = 4.0
# A strength without an upper bound is tried up to here.
STRONG = 1e3
# Scalars that reach this far (exponents) are walked decade by decade.
WIDE = 1e3


def walk(declared: Parameter) -> list[float]:
    """Where a scalar is tried: its bounds, the ends of its usual range, 1e-4, 1e-3, 1, and an exponent's decades up to 1e8."""
    high = STRONG if declared.high is None else declared.high
    found = {declared.low, high, *declared.usual, 1e-4, 1e-3, 1.0}
    if high >= WIDE:
        found |= {10.0**k for k in range(9)}
    return sorted({min(max(float(np.float32(x)), declared.low), high) for x in found if declared.low <= x <= high})


def at_extremes(name: str, most: int) -> list[Brdf]:
    """The model with each of its scalars at all places of the walk in turn, then by chance (but always the same) with all of
    them anywhere on it, `most` in all; and its colours at their ends."""
    model, random = BRDFS[name], np.random.default_rng(1)
    declared = model.parameters()
    scalars = {key: walk(d) for key, d in declared.items() if not model.is_colour(key)}
    bright: dict[str, Any] = {}
    for key in (key for key in declared if model.is_colour(key)):
        high = declared[key].high
        # Not grey, so that a channel taken for another is found out.
        bright[key] = tuple(x * (1.0 if high is None else high) for x in (1.0, 0.75, 0.5))
    found = [model(**bright, **chosen) for chosen in choices(model)]
    found += [model(**{key: declared[key].low for key in bright})]
    found += [model(**{**bright, key: declared[key].low}) for key in bright]
    found += [model(**bright, **{key: x}) for key, places in scalars.items() for x in places]
    if len(scalars) <= 4:
        # Two against each other: the ends of both, and ratios of 1e6.
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


def choices(model: type[Brdf]) -> list[dict[str, str]]:
    """Every combination of the model's options."""
    options = [[(key, value) for value in get_args(model.model_fields[key].annotation)] for key in model.choices()]
    return [dict(chosen) for chosen in itertools.product(*options)]


def ordinary(name: str, count: int) -> list[Brdf]:
    """`count` materials within the usual ranges, by chance but always the same; over decades where a range has several."""
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
    """(N, 3) unit float32."""
    x = np.asarray(x, dtype=np.float64)
    return (x / np.linalg.norm(x, axis=-1, keepdims=True)).astype(np.float32)


MIRROR = np.float32([-1, -1, 1])


def upward(count: int, seed: int) -> Array:
    """(count, 3) unit directions of the upper hemisphere."""
    d = np.random.default_rng(seed).normal(size=(count, 3))
    d[:, 2] = np.abs(d[:, 2])
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def at_height(z: Any, azimuth: Any) -> NDArray[np.float32]:
    """Directions whose z is exactly `z`."""
    z, azimuth = np.broadcast_arrays(np.asarray(z, dtype=np.float64), np.asarray(azimuth, dtype=np.float64))
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(azimuth), r * np.sin(azimuth), z], axis=-1).astype(np.float32)


def around(d: Any, offset: Array, seed: int) -> NDArray[np.float32]:
    """d (N, 3) turned away by the angles offset (N,), to sides chosen by chance."""
    side = np.random.default_rng(seed).normal(size=np.shape(d))
    side -= d * np.sum(side * d, axis=1, keepdims=True)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    return unit(d + offset[:, None] * side)


Pairs = tuple[NDArray[np.float32], NDArray[np.float32]]


def pairs() -> dict[str, Pairs]:
    """case -> l, v (N, 3), all the places where a model may break."""
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
    # The half vector, or the mirror direction, turns away by all angles at which a lobe may have its edge.
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
    """l, v (N, 3) of all cases, and beside each the case it is of."""
    l, v = (np.concatenate([pair[i] for pair in cases.values()]) for i in (0, 1))
    return l, v, np.repeat(list(cases), [len(pair[0]) for pair in cases.values()])


def exact(material: Brdf, l: Any, v: Any, tilt: float = TILT) -> tuple[Array, Array]:
    """(value, conditioning), each (N, 3): the float64 value at float32 inputs, and how far rounding those may move it.

    tilt: of the normal [rad]; 0 where that is taken to be +z exactly.
    """
    parameters = {name: rounded(x).astype(np.float64) for name, x in parameter_values(material).items()}

    def f(l: Array, v: Array, given: dict[str, Array]) -> Array:
        value: Array = type(material).brdf_cos(SimpleNamespace(**given, **material.chosen()), l, v)
        return np.broadcast_to(value, l.shape)

    l, v = np.asarray(l, dtype=np.float64), np.asarray(v, dtype=np.float64)
    value = f(l, v, parameters)
    moved = ROUNDING * np.abs(value)
    for axis in range(3):
        for of_l in (True, False):
            step = np.zeros((2, *l.shape))
            step[:, :, axis] = np.array([[1], [-1]]) * ROUNDING * (l if of_l else v)[:, axis]
            both = [f(l + s, v, parameters) if of_l else f(l, v + s, parameters) for s in step]
            moved = moved + np.max(np.abs(np.stack(both) - value), axis=0)
    # A normal that is tilted is a pair of directions that is turned: to the four sides, and between them.
    turned = []
    for x, y in itertools.product((-tilt, 0.0, tilt) if tilt else (0.0,), repeat=2):
        pair = l.copy(), v.copy()
        for d, before in zip(pair, (l, v), strict=True):
            d[:, 0] -= x * before[:, 2]
            d[:, 1] -= y * before[:, 2]
            d[:, 2] += x * before[:, 0] + y * before[:, 1]
        turned.append(f(*pair, parameters))
    moved = moved + np.max(np.abs(np.stack(turned) - value), axis=0)
    for name, x in parameters.items():
        both = [f(l, v, {**parameters, name: x * (1 + s)}) for s in (ROUNDING, -ROUNDING)]
        moved = moved + np.max(np.abs(np.stack(both) - value), axis=0)
    return value, moved


@dataclass
class Worst:
    """The largest of something, and where it was."""

    value: float = 0.0
    place: str = ""

    def add(self, values: Array, describe: Any) -> None:
        """values (N, 3). describe(i): what stands at row i."""
        highest = values.max(axis=-1)
        # Written so that what is not a number wins.
        index = int(np.argmax(np.where(np.isnan(highest), np.inf, highest)))
        if not highest[index] <= self.value:
            self.value, self.place = float(highest[index]), describe(index)


def relative(gpu: Any, value: Array) -> Array:
    """The error relative to max(1, |f cos|)."""
    result: Array = np.abs(gpu - value) / np.maximum(1, np.abs(value))
    return result


def in_conditioning(gpu: Any, value: Array, conditioning: Array) -> Array:
    """The error in units of the conditioning. What is lost below the smallest normal float is no error."""
    result: Array = np.maximum(np.abs(gpu - value) - TINY, 0) / (conditioning + TINY)
    return result


def measured(material: Brdf, stage: Stage, renderer: Renderer, l: Any, v: Any) -> NDArray[np.float32]:
    """f cos (N, 3) as the GPU has it. AssertionError for what is not finite."""
    gpu = evaluate(material, l, v, on=stage, context=renderer.context)
    bad = np.flatnonzero(~np.isfinite(gpu).all(axis=1))
    assert not len(bad), f"{material!r}: {gpu[bad[0]]} at l {l[bad[0]]}, v {v[bad[0]]}"
    return gpu
