"""Digits: finds the lines of GLSL that lose digits in float32.

A line's loss is the change of the result when the operations of that line alone are rounded to float32 and all others are
exact. Where rounding the inputs changes the result about as much, the question is ill-posed: the inputs do not say the result
any better, so no other formula could give it better.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.glsl.source import Stage
from glshade.spirv.arithmetic import FLOAT64, NEAREST, Arithmetic, RandomRounding

Array = NDArray[Any]

# A run of a text: takes inputs by name and an arithmetic, and returns the result (N, C).
Run = Callable[[Mapping[str, Any], Arithmetic], Array]

# Values below this one count as this large: a quarter of the step between two 8-bit codes, where light of 1 is white. Without
# it, the tail of every lobe would count, whose values nobody sees.
LEAST = 1e-3
# The number of runs with different random numbers, for each line and for rounding the inputs. A run seldom reaches the largest
# possible error, but the largest of four is nearly always more than a third of it. Rounding the inputs is the judge of every
# line at thousands of inputs, so it is run more often: the largest of 32 is never by chance less than half the usual one.
RUNS, INPUT_RUNS = 4, 32
# A line is worth a mention if it loses more than this: about 16 roundings of float32.
MENTIONED = 1e-6
# Rounding the inputs does as much as a line if it does at least this share of the line's loss. OpenGL allows an inversesqrt
# four times the error of a rounding, so a good line may lose four times as much; docs/accuracy.md promises no more either.
AS_MUCH = 0.25
# The largest error of a run at many inputs varies little from run to run. If it is this many times smaller than MENTIONED, the
# other runs of the line are left out, which halves the time.
HARMLESS = 4.0
# A line that is good but for the error that OpenGL allows a built-in function is to blame if it loses more than this, three
# decimal digits. No built-in function with an argument of usual size errs by a tenth of it: a formula must have magnified it.
MAGNIFIED = 1e-4
# The error of rounding a number to float32, relative to the number.
ROUNDING = 2.0**-24
# The smallest normal float32; a vector of zeros stays one when it is divided by it.
SMALLEST = 2.0**-126


@dataclass(frozen=True)
class LineLoss:
    """The digits that one line loses, at the inputs where its loss is largest.

    Inputs at which the question is ill-posed count only if the line loses no more than MENTIONED at all others.

    line: its number in the stage's text, counted from 1.
    place: the file and the line in it that it came from, as `file:line`.
    text: the line.
    loss: the error of the result that rounding in this line causes, relative to the result or to LEAST; at most 1.
    formula: the same error if built-in functions err by no more than an addition does.
    at: name -> the inputs there.
    value: the exact result (C,) at these inputs.
    inputs: the error, relative in the same way, that rounding the inputs causes there.
    """

    line: int
    place: str
    text: str
    loss: float
    formula: float
    at: Mapping[str, Any]
    value: tuple[float, ...]
    inputs: float

    @property
    def own(self) -> float:
        """The part of the loss that the line answers for: all of it if it magnifies the errors of built-in functions."""
        return self.loss if self.loss > MAGNIFIED else self.formula

    @property
    def ill_posed(self) -> bool:
        """Whether rounding the inputs does as much as this line."""
        return self.inputs >= AS_MUCH * (self.own if self.own > MENTIONED else self.loss)

    @property
    def built_in(self) -> bool:
        """Whether the line loses digits only by the error that OpenGL allows its built-in functions."""
        return self.own <= MENTIONED < self.loss and not self.ill_posed

    @property
    def to_blame(self) -> bool:
        """Whether the line loses more than MENTIONED, and neither the question nor built-in functions explain that."""
        return self.own > MENTIONED and not self.ill_posed

    @property
    def digits(self) -> float:
        """The number of decimal digits that are lost, beyond the rounding of one number."""
        return float(digits_lost(np.array(self.loss)))


@dataclass(frozen=True, eq=False)
class Digits:
    """The digits that a text loses at N inputs.

    lines: the lines with any loss, the greatest loss first.
    errors: (N,), the relative error of the result with all lines rounded.
    inputs: (N,), the relative error of the result with exact lines and rounded inputs.
    """

    lines: tuple[LineLoss, ...]
    errors: Array = field(repr=False)
    inputs: Array = field(repr=False)

    @property
    def bad(self) -> tuple[LineLoss, ...]:
        """The lines that are to blame."""
        return tuple(line for line in self.lines if line.to_blame)


@dataclass(frozen=True)
class _Recorder(RandomRounding):
    """Random rounding that notes the lines that round. seen: these lines."""

    seen: set[int] = field(default_factory=set)

    def rounded(self, values: Array, line: int, ulps: Array | float = NEAREST) -> Array:
        self.seen.add(line)
        return super().rounded(values, line, ulps)


def measure_digits(
    run: Run, inputs: Mapping[str, Any], stage: Stage, seed: int = 1, directions: Collection[str] = ()
) -> Digits:
    """Returns the digits that a text loses at some inputs.

    run: runs the text.
    inputs: name -> input, with the axis of lanes first, (N, ...), or without it where it is the same in all lanes.
    stage: the text.
    seed: the seed of the random numbers.
    directions: the names of the inputs that are unit vectors.
    Errors: ShaderError.
    """
    random = np.random.default_rng(seed)
    exact = run(inputs, FLOAT64)

    def worst(lines: Collection[int], correct: bool = False) -> Array:
        """Returns the largest error (N,) of RUNS runs in which only some lines are rounded."""
        return _worst(run, inputs, exact, RandomRounding(random=random, lines=lines, correct=correct))

    def well_posed(errors: Array) -> Array:
        """Returns the errors (N,) where they are larger than MENTIONED and than what rounding the inputs does; elsewhere 0."""
        return np.where((errors > MENTIONED) & (of_inputs < AS_MUCH * errors), errors, 0.0)

    recorder = _Recorder(random=random)
    run(inputs, recorder)
    rounded = (_rounded_inputs(inputs, random, directions) for _ in range(INPUT_RUNS))
    of_inputs = np.maximum.reduce([_errors(run(given, FLOAT64), exact) for given in rounded])
    text = stage.text.splitlines()
    found = []
    for line in sorted(recorder.seen):
        errors = worst({line})
        of_formula = worst({line}, correct=True) if well_posed(errors).any() else errors
        errors = np.maximum(errors, of_formula)
        ranks = (well_posed(of_formula), well_posed(errors), errors)
        at = int(np.argmax(next((rank for rank in ranks if rank.any()), errors)))
        if errors[at] > 0:
            source = text[line - 1].strip() if 0 < line <= len(text) else ""
            found.append(
                LineLoss(
                    line,
                    stage.place(line) if line else "shader",
                    source,
                    float(errors[at]),
                    float(of_formula[at]),
                    {name: _at(value, at, len(exact)) for name, value in inputs.items()},
                    tuple(map(float, exact[at])),
                    float(of_inputs[at]),
                )
            )
    found.sort(key=lambda loss: -loss.loss)
    return Digits(tuple(found), _worst(run, inputs, exact, RandomRounding(random=random)), of_inputs)


def measure_errors(run: Run, inputs: Mapping[str, Any], seed: int = 1) -> Array:
    """Returns the relative error (N,) of a text's result with all lines rounded. Errors: ShaderError."""
    return _worst(run, inputs, run(inputs, FLOAT64), RandomRounding(random=np.random.default_rng(seed)))


def _worst(run: Run, inputs: Mapping[str, Any], exact: Array, arithmetic: RandomRounding) -> Array:
    """Returns the largest error (N,) of RUNS runs; of one run where it shows that the others will not reach MENTIONED."""
    first = _errors(run(inputs, arithmetic), exact)
    if first.max(initial=0.0) < MENTIONED / HARMLESS:
        return first
    return np.asarray(np.maximum.reduce([first, *(_errors(run(inputs, arithmetic), exact) for _ in range(RUNS - 1))]))


def _errors(result: Array, exact: Array) -> Array:
    """Returns the relative error (N,) of a result: 1 where it is not finite.

    A result that is not finite in exact arithmetic has no digits to lose, so its error is 0.
    """
    finite = np.isfinite(exact)
    lost = np.abs(np.where(finite, result, 0.0) - np.where(finite, exact, 0.0)) / np.maximum(np.abs(exact), LEAST)
    lost = np.minimum(np.nan_to_num(lost, nan=1.0, posinf=1.0), 1.0)
    return np.asarray(np.where(finite, lost, 0.0).max(axis=1))


def digits_lost(errors: Array) -> Array:
    """Returns the number of decimal digits that relative errors cost, beyond the rounding of one number; 7.2 for an error of 1.

    errors: of any shape.
    """
    return np.asarray(np.log10(np.maximum(errors, ROUNDING) / ROUNDING))


def joined(several: Iterable[Digits]) -> Digits:
    """Returns the digits that several texts lose.

    Of a line that stands in several texts, the greatest loss counts, and one that is not ill-posed before all others.
    """
    several = list(several)
    lines: dict[str, LineLoss] = {}
    for loss in (loss for digits in several for loss in digits.lines):
        # Generated lines of different texts may have the same place, such as `<surface>:12`.
        key = f"{loss.place} {loss.text}"
        lines[key] = max(lines.get(key, loss), loss, key=lambda one: (one.to_blame, one.loss))
    errors, inputs = (np.concatenate([getattr(d, name) for d in several] or [np.zeros(0)]) for name in ("errors", "inputs"))
    return Digits(tuple(sorted(lines.values(), key=lambda loss: -loss.loss)), errors, inputs)


def _rounded_inputs(inputs: Mapping[str, Any], random: np.random.Generator, directions: Collection[str]) -> dict[str, Any]:
    """Returns the inputs, each number of which errs at random by at most a rounding to float32.

    A direction is turned instead, by at most a rounding of its length in each component: normalising or turning a vector does
    that, so nobody can give a direction any better. It keeps its length; a formula that needs that to be exactly 1 is to blame.
    """
    result: dict[str, Any] = {}
    for name, value in inputs.items():
        given = np.asarray(value)
        if given.dtype.kind == "f":
            given = given.astype(np.float64)
            length = np.linalg.norm(given, axis=-1, keepdims=True) if name in directions else None
            size = given if length is None else length
            given = given + size * random.uniform(-ROUNDING, ROUNDING, given.shape)
            if length is not None:
                given *= length / np.maximum(np.linalg.norm(given, axis=-1, keepdims=True), SMALLEST)
        result[name] = given
    return result


def _at(value: Any, lane: int, lanes: int) -> Any:
    """Returns an input in one lane, as numbers of Python."""
    array = np.asarray(value)
    return (array[lane] if array.ndim and len(array) == lanes else array).tolist()
