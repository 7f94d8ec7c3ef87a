"""Ranges: random inputs of a model over the ranges that it declares."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from glshade.brdfs import Brdf, Parameter, numbers

Array = NDArray[Any]

# Parameters without an upper bound are tried up to this many times the end of their usual range.
STRONG = 10.0
# A scalar whose range spans more than this factor is spread evenly over the decades.
DECADES = 10.0
# These shares of the lanes have a scalar at an end of its range, and directions near the mirror direction, near each other, and
# near the horizon. There the formulas of models are worst, and random directions seldom get there.
AT_AN_END, NEAR_MIRROR, NEAR_OTHER, NEAR_HORIZON = 0.2, 0.3, 0.1, 0.1
# The least angle from such a direction [rad]: near it, the directions are spread evenly over the decades of the angle.
NEAREST_ANGLE = 1e-4


def variants(model: type[Brdf]) -> Iterator[Brdf]:
    """Yields a material for every combination of a model's options. Its parameters are in the middle of their usual range."""
    middle: dict[str, Any] = {}
    for name, declared in model.parameters().items():
        value = sum(declared.usual) / 2
        middle[name] = (value, value, value) if model.is_colour(name) else value
    options = [[(key, value) for value in get_args(model.model_fields[key].annotation)] for key in model.choices()]
    for chosen in itertools.product(*options):
        yield model(**middle, **dict(chosen))


def directions(count: int, random: np.random.Generator) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Returns unit directions l and v, (count, 3) each, above the horizon, many of them where models are hard to compute."""
    l = _upward(random.normal(size=(count, 3)))
    low = random.random(count) < NEAR_HORIZON
    l[low, 2] *= _angles(int(low.sum()), random)
    l = _unit(l)
    v = _upward(random.normal(size=(count, 3)))
    kind = random.random(count)
    mirror, other = kind < NEAR_MIRROR, (kind >= NEAR_MIRROR) & (kind < NEAR_MIRROR + NEAR_OTHER)
    for where, target in ((mirror, l * (-1.0, -1.0, 1.0)), (other, l)):
        number = int(where.sum())
        v[where] = _upward(target[where] + _angles(number, random)[:, None] * random.normal(size=(number, 3)))
    return l.astype(np.float32), _unit(v).astype(np.float32)


def parameters(material: Brdf, count: int, random: np.random.Generator) -> dict[str, NDArray[np.float32]]:
    """Returns name -> random values of a material's parameters, (count,) or (count, 3), over the ranges that it declares."""
    model = type(material)
    fixed = numbers(material)
    result = {}
    for name, declared in model.parameters().items():
        shape = (count, 3) if model.is_colour(name) else (count,)
        result[name] = _spread(declared, shape, random).astype(fixed[name].dtype)
    return result


def _spread(declared: Parameter, shape: tuple[int, ...], random: np.random.Generator) -> Array:
    """Returns random numbers of a parameter's range, some of them at its ends."""
    low, high = declared.low, STRONG * declared.usual[1] if declared.high is None else declared.high
    share = random.random(shape)
    # A range that starts at zero has no decades of its own; its usual range may have some.
    start = low or declared.usual[0]
    value = start * (high / start) ** share if start > 0 and high > DECADES * start else low + (high - low) * share
    ends = np.where(random.random(shape) < 0.5, low, high)
    return np.asarray(np.where(random.random(shape) < AT_AN_END, ends, value))


def _angles(count: int, random: np.random.Generator) -> Array:
    """Returns angles between NEAREST_ANGLE and 1, spread evenly over the decades [rad]."""
    return NEAREST_ANGLE ** random.random(count)


def _upward(x: Array) -> Array:
    """Returns vectors (N, 3) with z made positive."""
    return np.asarray(x * np.where(x[:, 2:] < 0, (1.0, 1.0, -1.0), 1.0))


def _unit(x: Array) -> Array:
    return np.asarray(x / np.linalg.norm(x, axis=1, keepdims=True))
