"""Costs of the reflectance models: measures the time of an evaluation at a pixel and at a vertex, its operations, and its GLSL.

A program with the model's generated GLSL evaluates the model many times at each pixel, along directions that change from pixel
to pixel and from round to round (shaders/driver/evaluations.glsl). The time of the same program without a model is subtracted,
so that the time of the model remains.
"""

from __future__ import annotations

import itertools
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, get_args

from glshade.brdfs import BRDFS, Brdf
from glshade.driver.census import Operations, censuses
from glshade.driver.clock import Spread, on_cpu
from glshade.driver.workload import Workload
from glshade.gl.context import Backend, open_context
from glshade.glsl.generator import model_code
from glshade.glsl.shaders import Shaders, current, expand
from glshade.glsl.source import Code, Source, Stage
from glshade.glsl.uniforms import model_inputs
from glshade.scene.models import Folders, paths

# Default number of measurements of each model.
REPEAT = 7
# The GLSL that takes the place of the model in the program without a model, whose time is subtracted.
NOTHING = {"model": Code().add("vec3 value(Frame f, vec3 l, vec3 v) {\n    return vec3(0.0);\n}\n")}


@dataclass(frozen=True)
class Cost:
    """The cost of one material.

    model: name of the model
    variant: options that differ from the defaults; "" for the defaults
    pixel: time of an evaluation in the fragment stage [ns]
    vertex: time of an evaluation in the vertex stage [ns]
    operations: operations of one evaluation; None if the driver does not print them
    size: length of the material's GLSL with includes and uniforms, without comments and blank lines [bytes]
    """

    model: str
    variant: str
    pixel: Spread
    vertex: Spread
    operations: Operations | None
    size: int

    def as_dict(self) -> dict[str, Any]:
        """Returns the cost as JSON types."""
        return {
            "model": self.model,
            "variant": self.variant,
            "pixel_ns": self.pixel.as_dict(),
            "vertex_ns": self.vertex.as_dict(),
            "operations": self.operations and self.operations.as_dict(),
            "bytes": self.size,
        }


@dataclass(frozen=True)
class Costs:
    """The costs of several materials, and the conditions of the measurement.

    renderer: GL_RENDERER, the driver's name of the renderer
    version: GL_VERSION, the driver's version of OpenGL
    threads: number of cores that the process may use
    clock: "core" if the times are those of one core, because the CPU draws; "wall" if they are wall-clock times
    rounds: number of evaluations at each "pixel" and each "vertex"
    repeat: number of measurements of each material
    rows: the costs
    """

    renderer: str
    version: str
    threads: int
    clock: str
    rounds: Mapping[str, int]
    repeat: int
    rows: tuple[Cost, ...]

    def as_dict(self) -> dict[str, Any]:
        """Returns the costs as JSON types."""
        return {**vars(self), "rows": [row.as_dict() for row in self.rows]}


def variants(model: Any) -> dict[str, Brdf]:
    """Returns the materials of a model to measure: variant -> material.

    The variant "" has the defaults. Each other combination of the model's options is a variant, and so is "anisotropic" for a
    model that is isotropic by default.
    """
    plain = model()
    materials = {"": plain}
    options = [get_args(model.model_fields[name].annotation) for name in model.choices()]
    for values in itertools.product(*options):
        chosen = dict(zip(model.choices(), values, strict=True))
        changed = {name: value for name, value in chosen.items() if value != getattr(plain, name)}
        if changed:
            materials[", ".join(f"{name} {value}" for name, value in changed.items())] = model(**chosen)
    uneven = {name: 0.5 for name, value in model.isotropic_where.items() if isinstance(value, float | int)}
    if uneven and not plain.needs_tangents:
        materials["anisotropic"] = model(**uneven)
    return materials


def source(brdf: Brdf | None, stage: str, shaders: Shaders | None = None) -> Source:
    """Returns the program that evaluates a material many times in a stage.

    brdf: the material; None returns the program without a model
    stage: "fragment" or "vertex"
    shaders: shader files; None takes glshade's own
    """
    text = NOTHING if brdf is None else _text(brdf)
    if stage == "vertex":
        return Source(expand("pass/cost.vert", text, shaders), None)
    return Source(expand("pass/picture.vert", {}, shaders), expand("pass/cost.frag", text, shaders))


def _text(brdf: Brdf) -> dict[str, Code]:
    """Returns the GLSL code of `value(f, l, v)`, which evaluates the material in a frame f that differs from pixel to pixel."""
    return model_code(brdf, "vec3 value(Frame f, vec3 l, vec3 v)", "f")


def size(brdf: Brdf, shaders: Shaders | None = None) -> int:
    """Returns the length of a material's GLSL, without comments and blank lines [bytes].

    This is the length of its program minus that of the program without a model.
    """

    def bare(stage: Stage | None) -> int:
        assert stage is not None
        lines = (re.sub(r"//.*", "", line).rstrip() for line in stage.text.splitlines())
        return sum(len(line) + 1 for line in lines if line)

    return bare(source(brdf, "fragment", shaders).fragment) - bare(source(None, "fragment", shaders).fragment)


def operations(
    brdfs: Sequence[Brdf], backend: Backend = "auto", device: int | None = None, shaders: Shaders | None = None
) -> list[Operations | None]:
    """Returns the operations of one evaluation of each material; None if the driver does not print them.

    Errors: as for `censuses`.
    """
    sources = [source(brdf, "fragment", shaders) for brdf in (None, *brdfs)]
    nothing, *counts = [census and census.fragment for census in censuses(sources, backend, device)]
    return [count - nothing if count and nothing else None for count in counts]


def costs(
    names: Sequence[str] | None = None,
    repeat: int = REPEAT,
    backend: Backend = "auto",
    device: int | None = None,
    shaders: Folders | None = None,
) -> Costs:
    """Measures the cost of models in each of their variants.

    names: names of the models; None or empty measures all
    repeat: number of measurements of each material, whose median and range are reported
    backend: OpenGL backend, as for Renderer
    device: EGL device; None leaves the choice to the driver
    shaders: the user's own shader folders
    Errors: KeyError for an unknown model; ContextError; ShaderError.
    """
    materials = [(name, variant, brdf) for name in names or BRDFS for variant, brdf in variants(BRDFS[name]).items()]
    files = current(paths(shaders))
    counted = operations([brdf for _, _, brdf in materials], backend, device, files)
    context = open_context(backend, device)
    try:
        benches = {stage: Workload(context, stage, source(None, stage, files)) for stage in ("fragment", "vertex")}
        rows = []
        for (name, variant, brdf), count in zip(materials, counted, strict=True):
            pixel, vertex = (
                benches[stage].nanoseconds(source(brdf, stage, files), model_inputs(brdf), repeat)
                for stage in ("fragment", "vertex")
            )
            rows.append(Cost(name, variant, pixel, vertex, count, size(brdf, files)))
        return Costs(
            renderer=context.renderer,
            version=context.version,
            threads=_threads(),
            clock="core" if on_cpu(context) else "wall",
            rounds={"pixel": benches["fragment"].rounds, "vertex": benches["vertex"].rounds},
            repeat=repeat,
            rows=tuple(rows),
        )
    finally:
        context.release()


def _threads() -> int:
    """Returns the number of cores that this process may use. A software driver runs one thread on each of them."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def table(measured: Costs) -> list[tuple[str, ...]]:
    """Returns rows of text; the first row holds the headings.

    The columns are the model, the times at a pixel and at a vertex [ns] with their ranges, the operations and the bytes.
    """

    def ns(spread: Spread) -> tuple[str, str]:
        return f"{spread.median:6.2f}", f"{spread.low:.2f} to {spread.high:.2f}"

    rows: list[tuple[str, ...]] = [("model", " pixel", "range", "vertex", "range", " ops", "of these", "bytes")]
    for row in measured.rows:
        name = f"{row.model} ({row.variant})" if row.variant else row.model
        counted = ("   -", "-") if row.operations is None else (f"{row.operations.total:4}", str(row.operations))
        rows.append((name, *ns(row.pixel), *ns(row.vertex), *counted, f"{row.size:5}"))
    return rows
