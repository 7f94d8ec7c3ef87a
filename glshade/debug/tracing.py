"""Tracing: `trace`, which shows the value of every variable of a model's GLSL, in float64, in float32 and on the GPU."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glshade.brdfs import Brdf
from glshade.debug.instrument import can_be_kept, instrumented
from glshade.errors import ContextError, ShaderError
from glshade.gl.context import Context, open_context
from glshade.gl.evaluation import run_on_gpu
from glshade.gl.tables import Inputs
from glshade.glsl.generator import value_code
from glshade.glsl.shaders import Shaders, current
from glshade.glsl.source import Code, Stage
from glshade.glsl.uniforms import model_inputs
from glshade.scene.models import Folders, paths, use_models
from glshade.spirv.arithmetic import FLOAT32, FLOAT64, TINY, Arithmetic
from glshade.spirv.digits import ROUNDING
from glshade.spirv.model import ValueText, model_text
from glshade.spirv.trace import Recorder, Step, short

Array = NDArray[Any]
StageName = Literal["vertex", "fragment"]


@dataclass(frozen=True)
class TracedStep:
    """The value of a variable after a line has run, or the result of a function.

    place: the file and the line in it, as `file:line`.
    text: the line.
    function: the function that the line stands in.
    name: the variable with the path to the member that changes, such as `m.kd`, or `return`.
    type: its type in GLSL.
    float64: its value in float64, on the CPU.
    float32: its value in float32, on the CPU; None where float32 does not run the line.
    vertex, fragment: its value in that stage on the GPU; None where it is not known.
    """

    place: str
    text: str
    function: str
    name: str
    type: str
    float64: Any
    float32: Any
    vertex: Any = None
    fragment: Any = None

    @classmethod
    def of(cls, exact: Step, single: Step | None, vertex: Any = None, fragment: Any = None) -> TracedStep:
        """Returns a step of a run of one lane in float64, and the same step in float32 if there is one."""
        other = None if single is None else _first(single.value)
        return cls(
            exact.place, exact.text, exact.function, exact.name, exact.type, _first(exact.value), other, vertex, fragment
        )

    @property
    def digits(self) -> float:
        """The number of decimal digits that float32 has lost here, beyond the rounding of one number."""
        # A result that is not a number has lost everything.
        error = np.nan_to_num(self.error, nan=1.0, posinf=1.0)
        return float(np.log10(np.clip(error, ROUNDING, 1.0) / ROUNDING))

    @property
    def error(self) -> float:
        """The largest difference between float32 and float64, relative to the largest component."""
        if self.float32 is None or isinstance(self.float64, tuple) or np.asarray(self.float64).dtype.kind != "f":
            return 0.0
        size = np.abs(self.float64).max()
        with np.errstate(invalid="ignore"):
            # The difference of infinities is not a number, although they may be the same one.
            away = np.where(np.equal(self.float32, self.float64), 0.0, np.asarray(self.float32, np.float64) - self.float64)
            # A difference of less than the smallest normal float32 is no fault: a driver may flush such numbers to zero.
            away = np.where(np.abs(away) < TINY, 0.0, np.abs(away))
            return float(away.max() / size) if size > 0 else 0.0


@dataclass(frozen=True)
class Trace:
    """The steps of one evaluation, in the order in which they ran.

    steps: the steps.
    """

    steps: tuple[TracedStep, ...]

    def __str__(self) -> str:
        """Returns a table of the steps: place, variable, and its values in float64, in float32 and, if known, on the GPU."""
        stages = [name for name in ("vertex", "fragment") if any(getattr(step, name) is not None for step in self.steps)]
        rows = [
            (s.place.rpartition("/")[2], s.name, *(short(getattr(s, on)) for on in ("float64", "float32", *stages)), s.text)
            for s in self.steps
        ]
        heads = ("line", "variable", "float64", "float32", *(f"{stage} stage" for stage in stages), "text")
        widths = [max(len(row[i]) for row in (heads, *rows)) for i in range(len(heads))]
        return "\n".join(
            "  ".join(f"{cell:{width}}" for cell, width in zip(row, widths, strict=True)).rstrip() for row in (heads, *rows)
        )


def trace(
    brdf: Brdf,
    l: ArrayLike,
    v: ArrayLike,
    *,
    gpu: bool = True,
    context: Context | None = None,
    shaders: Folders | None = None,
    models: Folders | None = None,
) -> Trace:
    """Returns the value of every variable of a model's GLSL at one pair of directions.

    brdf: a model with its parameters, none of which may be a texture.
    l, v: unit directions (3,) to the light and to the viewer, in the local frame, where the normal is +z and the tangent is +x.
    gpu: whether to run the text on the GPU too. Where no context can be opened, it runs on the CPU alone.
    context: optional; the context to use. Default: a new one for this call.
    shaders, models: optional; the user's shader and model folders, as for Renderer.
    Errors: ValueError, ShaderError, SceneError, MissingLibrary.
    """
    use_models(models)
    files = current(paths(shaders))
    pair = [np.asarray(d, dtype=np.float32).reshape(-1) for d in (l, v)]
    if any(d.shape != (3,) for d in pair):
        raise ValueError(f"l and v must have shape (3,), not {np.shape(l)} and {np.shape(v)}")
    values = model_inputs(brdf)
    text = model_text(brdf, files)
    inputs = {"a_l": pair[0][None], "a_v": pair[1][None], **values}
    exact, single = (_recorded(text, inputs, arithmetic) for arithmetic in (FLOAT64, FLOAT32))
    on_gpu: dict[StageName, dict[int, Any]] = {}
    if gpu:
        on_gpu = _on_gpu(context, value_code(brdf), values, pair, files, exact, text.stage)
    steps = []
    for index, (step, other) in enumerate(paired(exact, single)):
        steps.append(TracedStep.of(step, other, *[on_gpu.get(stage, {}).get(index) for stage in ("vertex", "fragment")]))
    return Trace(tuple(steps))


def paired(exact: Iterable[Step], single: Iterable[Step]) -> Iterator[tuple[Step, Step | None]]:
    """Yields each step of a run in float64 with the same step of a run in float32; None where float32 does not run the line."""
    others = dict(_numbered(single))
    return ((step, others.get(key)) for key, step in _numbered(exact))


def _numbered(steps: Iterable[Step]) -> Iterator[tuple[tuple[str, str, int], Step]]:
    """Yields ((place, variable, how many times it has run before), step)."""
    times: Counter[tuple[str, str]] = Counter()
    for step in steps:
        key = step.place, step.name
        yield (*key, times[key]), step
        times[key] += 1


def _recorded(text: ValueText, inputs: Mapping[str, Any], arithmetic: Arithmetic) -> list[Step]:
    """Returns the steps of one run. Errors: ShaderError."""
    recorder = Recorder(text.module, text.stage, 1)
    text.run(inputs, 1, arithmetic, recorder.observe)
    return recorder.steps


def _on_gpu(
    context: Context | None,
    code: Mapping[str, Code | str],
    values: Inputs,
    pair: list[Array],
    shaders: Shaders,
    steps: list[Step],
    stage: Stage,
) -> dict[StageName, dict[int, Any]]:
    """Returns stage -> index of a step -> its value on the GPU; nothing where no context can be opened.

    A line that runs several times has its last value, so only the last of its steps gets one.
    """
    times = Counter((step.place, step.name) for step in steps)
    seen: Counter[tuple[str, str]] = Counter()
    wanted: dict[int, Step] = {}
    for index, step in enumerate(steps):
        seen[step.place, step.name] += 1
        if can_be_kept(step, stage) and seen[step.place, step.name] == times[step.place, step.name]:
            wanted[index] = step
    try:
        opened = context or open_context()
    except ContextError:
        return {}
    found: dict[StageName, dict[int, Any]] = {}
    stages: tuple[StageName, ...] = ("vertex", "fragment")
    try:
        for name in stages:
            found[name] = _in_stage(opened, name, code, values, pair, shaders, wanted)
        return found
    finally:
        if context is None:
            opened.release()


def _in_stage(
    context: Context,
    stage: StageName,
    code: Mapping[str, Code | str],
    values: Inputs,
    pair: list[Array],
    shaders: Shaders,
    wanted: Mapping[int, Step],
) -> dict[int, Any]:
    """Returns index of a step -> its value in a stage. A text that cannot be changed for all steps is changed for each."""

    def run(steps: Mapping[int, Step]) -> dict[int, Any]:
        # Each vertex or pixel returns another step.
        l, v = (np.tile(d, (len(steps), 1)) for d in pair)
        chosen = list(steps.values())
        result = run_on_gpu(context, stage, code, values, l, v, shaders, lambda source: instrumented(source, chosen))
        return {index: _typed(value, step) for value, (index, step) in zip(result, steps.items(), strict=True)}

    if not wanted:
        return {}
    try:
        return run(wanted)
    except ShaderError:
        found: dict[int, Any] = {}
        for index, step in wanted.items():
            with suppress(ShaderError):
                found |= run({index: step})
        return found


def _typed(value: Array, step: Step) -> Any:
    """Returns three numbers of the GPU as a value of the step's type."""
    if step.type in ("vec2", "vec3"):
        return value[: int(step.type[-1])]
    return {"int": int, "bool": bool}.get(step.type, np.float32)(value[0])


def _first(value: Any) -> Any:
    """Returns a value in the first lane."""
    return tuple(map(_first, value)) if isinstance(value, tuple) else value[0]
