"""Fitting: the parameters of a model with which it comes nearest to measured reflectance.

The error is that of Löw et al. (2012): the differences of log(1 + f cos), squared. It weighs a highlight and the darker
surroundings alike. The one of Ngan et al. (2005) is offered too: the differences of f cos itself, squared.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, Literal

import numpy as np

from glshade.arrays import Float64
from glshade.brdfs import Brdf, Parameter
from glshade.measured.samples import Measurement, Samples, points

Metric = Literal["log-cosine", "cosine"]
METRICS: tuple[Metric, ...] = ("log-cosine", "cosine")
# The samples that a fit looks at; more of them cost time and move the parameters by less than a percent.
MOST_SAMPLES = 1500
# The values that a scalar takes in the first search, the values of a colour that the model is not linear in, and the most
# combinations of them. The best FINALISTS of the combinations are improved, and the best of these is the fit.
SCALAR_STARTS, COLOUR_STARTS, MOST_STARTS, FINALISTS = 5, (0.05, 0.5), 48, 4
# A scalar whose usual range spans this factor is searched by its logarithm.
WIDE = 30.0
# How much less than its usual lowest value such a scalar may become.
BELOW_USUAL = 0.01
# Parameters are redundant where the smallest singular value of the derivatives is below this share of the largest.
REDUNDANT = 1e-8
# Why a parameter is not fitted.
WITHOUT_EFFECT, EXCHANGEABLE = "light from a direction does not depend on it", "the other parameters can stand in for it"
# The calls of the model in the improvement of one finalist, and in the last improvement of the best.
CALLS, LAST_CALLS = 40, 200


@dataclass(frozen=True)
class Fit:
    """A material that was fitted to samples.

    material: the material.
    error: the root of the mean squared error by the metric.
    held: parameters that the samples do not determine, each with the reason; they have the value at which the fit began.
    """

    material: Brdf
    error: float
    held: Mapping[str, str]


def fit_model(
    measurement: Measurement,
    model: type[Brdf],
    metric: Metric = "log-cosine",
    fixed: Mapping[str, Any] | None = None,
    start: Mapping[str, Any] | None = None,
) -> Fit:
    """Returns the material of a model that comes nearest to a measurement.

    Those parameters are free that the starting material reads for light from a direction.

    metric: the error that is made small.
    fixed: parameters and options that keep a value.
    start: values from which the search begins; a part of a model that its defaults switch off takes part if it starts with a
        weight.
    Errors: ValueError, where the model has no free parameter; pydantic's ValidationError for values that the model refuses.
    """
    fixed, start = dict(fixed or {}), dict(start or {})
    samples = thinned(points(measurement, MOST_SAMPLES))
    first = _first(model, samples, {**start, **fixed})
    problem = _Problem(first, samples, metric, [name for name in _free(first) if name not in fixed])
    if not problem.names:
        raise ValueError(f"{first.brdf} has no parameter that is free and that light from a direction depends on")
    idle = _without_effect(problem)
    problem = _Problem(first, samples, metric, [name for name in problem.names if name not in idle])
    held = {name: WITHOUT_EFFECT for name in model.parameters() if name not in _free(first) or name in idle}
    problems, redundant = _without_redundant(problem)
    found = min((_best(each) for each in problems), key=lambda one: one[1])
    held |= {name: EXCHANGEABLE for name in redundant if name not in found[2].names and name not in fixed}
    values = found[2].values(found[0])
    material = first.model_copy(update={name: _plain(value) for name, value in {**found[2].held, **values}.items()})
    shown = {name: why for name, why in held.items() if name not in fixed and name not in start}
    return Fit(type(first).model_validate(material.model_dump(exclude_none=True)), found[1], shown)


def thinned(samples: Samples) -> Samples:
    """Returns the samples, or a random choice of MOST_SAMPLES of them."""
    if len(samples) <= MOST_SAMPLES:
        return samples
    return samples.chosen(np.sort(np.random.default_rng(0).choice(len(samples), MOST_SAMPLES, replace=False)))


def transformed(f_cos: Float64, metric: Metric) -> Float64:
    """Returns f cos as the metric compares it."""
    return np.log1p(np.maximum(f_cos, 0.0)) if metric == "log-cosine" else f_cos


def _first(model: type[Brdf], samples: Samples, given: Mapping[str, Any]) -> Brdf:
    """Returns the material from which the search begins. Data of a surface with a grain begin with a stretched lobe."""
    values = dict(given)
    if samples.oriented:
        for name, isotropic in model.isotropic_where.items():
            if name not in values:
                usual = model.parameters()[name].usual
                low, high = model.parameters()[name].low, model.parameters()[name].high
                base = getattr(model.model_validate({}), isotropic) if isinstance(isotropic, str) else isotropic
                stretched = 0.7 * base + 0.3 * (usual[1] if abs(usual[1] - base) > 1e-6 else usual[0])
                values[name] = min(max(stretched, low), high if high is not None else math.inf)
    return model.model_validate({"brdf": model.model_fields["brdf"].default, **values})


def _free(material: Brdf) -> list[str]:
    """Returns the parameters that light from a direction depends on, in the order of their declaration."""
    asked = material.asked("light")
    return [
        name for name, declared in material.parameters().items() if name in asked and not _follows(material, name, declared)
    ]


def _follows(material: Brdf, name: str, declared: Parameter) -> bool:
    """Returns whether a parameter was left out, so that it has the value of another one."""
    return getattr(material, name) is None and declared.same_as is not None


def _plain(value: Any) -> Any:
    return tuple(map(float, value)) if np.ndim(value) else float(value)


class _Problem:
    """A model, samples, a metric, and a vector x of numbers that stand for the free parameters.

    names: the free parameters.
    low, high: the bounds (K,) of x.
    held: values of parameters that differ from those of the starting material.
    """

    def __init__(self, first: Brdf, samples: Samples, metric: Metric, names: list[str], held: Mapping[str, Any] | None = None):
        """held: values of parameters that differ from those of `first`."""
        self.first, self.samples, self.metric, self.names = first, samples, metric, names
        self.held = dict(held or {})
        self._declared = first.parameters()
        self._model = type(first)
        self._sizes = [3 if first.is_colour(name) else 1 for name in names]
        ends = np.array([end for name, size in zip(names, self._sizes, strict=True) for end in [self._ends(name)] * size])
        self.low, self.high = ends.reshape(-1, 2).T
        self._cosine = samples.l[:, 2:]
        self.target = transformed(samples.f * self._cosine, metric)

    def wide(self, name: str) -> bool:
        """Returns whether x holds the logarithm of a parameter."""
        low, high = self._declared[name].usual
        return not self.first.is_colour(name) and low > 0 and high / low >= WIDE

    def _ends(self, name: str) -> tuple[float, float]:
        declared = self._declared[name]
        high = math.inf if declared.high is None else declared.high
        if self.wide(name):
            return math.log(max(declared.low, BELOW_USUAL * declared.usual[0])), math.log(high)
        return declared.low, high

    def values(self, x: Float64) -> dict[str, Any]:
        """Returns the values of the free parameters: colours (3,) and scalars ()."""
        parts = np.split(x, np.cumsum(self._sizes)[:-1])
        return {
            name: part if size == 3 else np.exp(part[0]) if self.wide(name) else part[0]
            for name, size, part in zip(self.names, self._sizes, parts, strict=True)
        }

    def vector(self, values: Mapping[str, Any]) -> Float64:
        """Returns x of values of the free parameters."""
        parts = [np.log(values[name]) if self.wide(name) else values[name] for name in self.names]
        x = np.concatenate([np.atleast_1d(np.asarray(part, np.float64)) for part in parts])
        return np.asarray(np.clip(x, self.low, self.high), np.float64)

    def f_cos(self, values: Mapping[str, Any], samples: Samples | None = None) -> Float64:
        """Returns f cos (N, 3) of the material with these values of the free parameters."""
        samples = samples or self.samples
        of_first = {
            name: np.asarray(value, np.float64) for name in self._declared if (value := getattr(self.first, name)) is not None
        }
        all_values: dict[str, Any] = {**of_first, **self.held, **values}
        for name, declared in self._declared.items():
            if name not in all_values and declared.same_as:
                all_values[name] = all_values[declared.same_as]
        m = SimpleNamespace(**all_values, **self.first.chosen())
        l, v = samples.l, samples.v
        with np.errstate(all="ignore"):
            f_cos = np.broadcast_to(self._model.brdf_cos(m, l, v), samples.f.shape)
            if samples.symmetric and "reciprocity" in self._model.breaks:
                f_cos = (f_cos + self._model.brdf_cos(m, v, l) / v[:, 2:] * l[:, 2:]) / 2
        return np.asarray(np.nan_to_num(f_cos))

    def residuals(self, x: Float64) -> Float64:
        return (transformed(self.f_cos(self.values(x)), self.metric) - self.target).ravel()

    def error(self, x: Float64) -> float:
        return float(np.sqrt(np.mean(self.residuals(x) ** 2)))

    def without(self, name: str, value: float) -> _Problem:
        """Returns the problem in which one parameter keeps a value."""
        return _Problem(
            self.first, self.samples, self.metric, [n for n in self.names if n != name], {**self.held, name: np.float64(value)}
        )


def _without_redundant(problem: _Problem) -> tuple[list[_Problem], set[str]]:
    """Returns problems whose parameters are all determined by the samples, and the names of the parameters that are not.

    Where several parameters can stand in for each other, there is one problem for each scalar among them, which is held.
    """
    names = _redundant(problem)
    if not names:
        return [problem], set()
    found: list[_Problem] = []
    all_names = set(names)
    for name in names:
        for value in _held_values(problem.first, name):
            smaller, more = _without_redundant(problem.without(name, value))
            found += smaller
            all_names |= more
    return found, all_names


def _held_values(first: Brdf, name: str) -> list[float]:
    """Returns the values at which a redundant scalar is held: where it starts, or both ends of a range that has two signs."""
    declared = first.parameters()[name]
    if declared.low < 0 and declared.high is not None:
        # Such a factor belongs to a direction, whose length another parameter can make up for. Its largest factor is 1 or -1.
        return [declared.low, declared.high]
    return [float(getattr(first, name) or 0.0)]


def _derivatives(problem: _Problem) -> Float64:
    """Returns the derivatives (R, K) of the residuals at a point in the midst of the usual ranges, where no part is off."""
    x = problem.vector({name: _middle(problem.first, name) for name in problem.names})
    columns = []
    for k in range(len(x)):
        step = 1e-6 * max(1.0, abs(x[k])) * np.eye(len(x))[k]
        columns.append((problem.residuals(x + step) - problem.residuals(x - step)) / (2 * step[k]))
    return np.stack(columns, axis=-1)


def _without_effect(problem: _Problem) -> set[str]:
    """Returns the free parameters that change nothing, because others are kept at values that switch them off."""
    if not problem.names:
        return set()
    moved = np.abs(_derivatives(problem)).max(axis=0) > 0
    sizes = [3 if problem.first.is_colour(name) else 1 for name in problem.names]
    parts = np.split(moved, np.cumsum(sizes)[:-1])
    return {name for name, part in zip(problem.names, parts, strict=True) if not part.any()}


def _redundant(problem: _Problem) -> list[str]:
    """Returns the scalars without which the others would be determined, because others can stand in for them."""
    if len(problem.names) < 2:
        return []
    derivatives = _derivatives(problem)
    length = np.linalg.norm(derivatives, axis=0)
    _, singular, rows = np.linalg.svd(derivatives / np.where(length > 0, length, 1), full_matrices=False)
    null = rows[singular < max(REDUNDANT * singular[0], 1e-7)]
    if not len(null):
        return []
    places = np.split(np.abs(null).max(axis=0), np.cumsum([3 if problem.first.is_colour(n) else 1 for n in problem.names])[:-1])
    return [
        name
        for name, share in zip(problem.names, places, strict=True)
        if share.max() > 1e-3 and not problem.first.is_colour(name)
    ]


def _middle(first: Brdf, name: str) -> Any:
    declared = first.parameters()[name]
    low, high = declared.usual
    if first.is_colour(name):
        return np.array([0.3, 0.4, 0.5]) * (high - low) + low
    value = getattr(first, name)
    if low < 0:
        # The sign of a factor says a direction, so its starting value is kept.
        return 0.9 * float(value if value is not None else high)
    return math.sqrt(low * high) if low > 0 and high / low >= WIDE else 0.6 * low + 0.4 * high


def _best(problem: _Problem) -> tuple[Float64, float, _Problem]:
    """Returns the x of the smallest error that was found, that error, and the problem."""
    from scipy.optimize import least_squares

    candidates = sorted(
        (_start(problem, dict(zip(_searched(problem), chosen, strict=True))) for chosen in _choices(problem)), key=problem.error
    )
    finalists = []
    for x in candidates[:FINALISTS]:
        inside = np.clip(x, problem.low + 1e-9, problem.high - 1e-9)
        done = least_squares(
            problem.residuals, inside, bounds=(problem.low, problem.high), x_scale="jac", ftol=1e-5, max_nfev=CALLS
        )
        finalists.append(done.x)
        if problem.error(done.x) < 1e-9:
            break
    x = min(finalists, key=problem.error)
    last = least_squares(
        problem.residuals,
        np.clip(x, problem.low + 1e-12, problem.high - 1e-12),
        bounds=(problem.low, problem.high),
        x_scale="jac",
        ftol=1e-13,
        xtol=1e-13,
        gtol=1e-15,
        max_nfev=LAST_CALLS,
    )
    return last.x, problem.error(last.x), problem


def _linear(problem: _Problem) -> list[str]:
    """Returns the free colours that f is linear in."""
    return [name for name in type(problem.first).linear if name in problem.names]


def _searched(problem: _Problem) -> list[str]:
    return [name for name in problem.names if name not in _linear(problem)]


def _choices(problem: _Problem) -> Iterable[tuple[Any, ...]]:
    """Returns the starting values of the parameters that f is not linear in: all combinations, or a random choice of them."""
    grids: list[list[Any]] = []
    for name in _searched(problem):
        low, high = problem.first.parameters()[name].usual
        if problem.first.is_colour(name):
            grids.append([np.full(3, low + share * (high - low)) for share in COLOUR_STARTS])
        elif problem.wide(name):
            grids.append(list(np.geomspace(low, high, SCALAR_STARTS)))
        elif low < 0:
            grids.append([0.9 * float(getattr(problem.first, name) or high), 0.5 * float(getattr(problem.first, name) or high)])
        else:
            grids.append(list(low + (high - low) * (np.arange(SCALAR_STARTS) + 0.5) / SCALAR_STARTS))
    every = list(itertools.product(*grids)) if math.prod(map(len, grids)) <= 20_000 else []
    chance = np.random.default_rng(0)
    if not every:
        return [tuple(grid[chance.integers(len(grid))] for grid in grids) for _ in range(MOST_STARTS)]
    if len(every) <= MOST_STARTS:
        return every
    return [every[index] for index in chance.choice(len(every), MOST_STARTS, replace=False)]


def _start(problem: _Problem, searched: Mapping[str, Any]) -> Float64:
    """Returns x for values of the parameters that f is not linear in, with the best values of the others."""
    from scipy.optimize import lsq_linear

    linear = _linear(problem)
    values: dict[str, Any] = {**searched, **{name: np.zeros(3) for name in linear}}
    if not linear:
        return problem.vector(values)
    dark = problem.f_cos(values)
    shares = [problem.f_cos({**values, name: np.ones(3)}) - dark for name in linear]
    wanted = problem.samples.f * problem.samples.l[:, 2:]
    weight = 1 / (1 + np.abs(wanted)) if problem.metric == "log-cosine" else np.ones_like(wanted)
    declared = problem.first.parameters()
    ends = [(declared[name].low, math.inf if declared[name].high is None else declared[name].high) for name in linear]
    for channel in range(3):
        columns = np.stack([share[:, channel] for share in shares], axis=-1) * weight[:, channel, None]
        rest = (wanted - dark)[:, channel] * weight[:, channel]
        for name, value in zip(linear, lsq_linear(columns, rest, tuple(zip(*ends, strict=True))).x, strict=True):
            values[name] = values[name].copy()
            values[name][channel] = value
    return problem.vector(values)
