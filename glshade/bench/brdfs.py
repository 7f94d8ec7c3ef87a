"""What a reflectance model costs: a pixel, a vertex, and in operations.

A model is evaluated many times a pixel along directions that change from pixel to pixel and from round to round
(shaders/lib/evaluations.glsl), in a program with the model's generated text and its parameters as uniforms. The same program
without a model is taken off: what remains is the model.
"""

from __future__ import annotations

import itertools
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, get_args

from glshade.brdfs import BRDFS, Brdf, numbers
from glshade.driver.census import Operations, censuses
from glshade.driver.clock import Spread, on_cpu
from glshade.driver.workload import Workload
from glshade.gl.context import Backend, open_context
from glshade.glsl.generator import Source, Stage, expand

REPEAT = 7
# The model of the program that is taken off. Adding a model's value to those before it is the model's.
NOTHING = {"model": "vec3 value(Frame f, vec3 l, vec3 v) {\n    return vec3(0.0);\n}\n"}


@dataclass(frozen=True)
class Cost:
    """What one material costs. pixel, vertex: an evaluation there [ns]; operations: None where the driver shows none;
    size: bytes of GLSL without comments and blank lines, includes and uniforms counted."""

    model: str
    variant: str
    pixel: Spread
    vertex: Spread
    operations: Operations | None
    size: int

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
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
    """Costs, and on what they were measured. threads: those that the machine offers; clock: what the times are of, "core" (one
    core's, where the CPU draws) or "wall"; rounds: evaluations a pixel and a vertex; repeat: measurements of each."""

    renderer: str
    version: str
    threads: int
    clock: str
    rounds: Mapping[str, int]
    repeat: int
    rows: tuple[Cost, ...]

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {**vars(self), "rows": [row.as_dict() for row in self.rows]}


def variants(model: Any) -> dict[str, Brdf]:
    """What to measure of a model, name -> material: "" is its defaults; then each other combination of its options, and the
    anisotropic material of a model whose default is isotropic."""
    plain = model()
    found = {"": plain}
    options = [get_args(model.model_fields[name].annotation) for name in model.choices()]
    for values in itertools.product(*options):
        chosen = dict(zip(model.choices(), values, strict=True))
        changed = {name: value for name, value in chosen.items() if value != getattr(plain, name)}
        if changed:
            found[", ".join(f"{name} {value}" for name, value in changed.items())] = model(**chosen)
    uneven = {name: 0.5 for name, value in model.isotropic_where.items() if isinstance(value, float | int)}
    if uneven and not plain.needs_tangents:
        found["anisotropic"] = model(**uneven)
    return found


def source(brdf: Brdf | None, stage: str) -> Source:
    """The program that evaluates a material in that stage, "fragment" or "vertex"; None: nothing in its place."""
    text = NOTHING if brdf is None else _text(brdf)
    if stage == "vertex":
        return Source(expand("pass/cost.vert", text), None)
    return Source(expand("pass/picture.vert", {}), expand("pass/cost.frag", text))


def _text(brdf: Brdf) -> dict[str, str]:
    """The model's include, its uniforms, and `value(f, l, v)`: the frame is another at each pixel."""
    names = list(brdf.parameters())
    text = f'#include "brdf/{brdf.brdf}.glsl"\n'
    text += "".join(f"uniform {'vec3' if brdf.is_colour(name) else 'float'} u_{name};\n" for name in names)
    struct = f"{BRDFS.class_name(brdf.brdf)}({', '.join(f'u_{name}' for name in names)})"
    text += f"\nvec3 value(Frame f, vec3 l, vec3 v) {{\n    return brdf_cos({struct}, f, l, v);\n}}\n"
    return {**brdf.slots(), "model": text}


def size(brdf: Brdf) -> int:
    """Bytes of a material's GLSL: what its program has beyond one without a model; comments and blank lines are not counted."""

    def bare(stage: Stage | None) -> int:
        assert stage is not None
        lines = (re.sub(r"//.*", "", line).rstrip() for line in stage.text.splitlines())
        return sum(len(line) + 1 for line in lines if line)

    return bare(source(brdf, "fragment").fragment) - bare(source(None, "fragment").fragment)


def operations(brdfs: Sequence[Brdf], backend: Backend = "auto", device: int | None = None) -> list[Operations | None]:
    """What one evaluation of each asks for; None where the driver does not show it. Errors: as of `censuses`."""
    found = [one and one.fragment for one in censuses([source(brdf, "fragment") for brdf in (None, *brdfs)], backend, device)]
    nothing = found[0]
    return [one - nothing if one and nothing else None for one in found[1:]]


def costs(
    names: Sequence[str] | None = None, repeat: int = REPEAT, backend: Backend = "auto", device: int | None = None
) -> Costs:
    """The cost of the models called `names`, all of them by default, in each of their variants.

    repeat: measurements of each, whose median and range are told. Errors: KeyError for a model that there is not,
    ContextError, ShaderError.
    """
    materials = [(name, said, brdf) for name in names or BRDFS for said, brdf in variants(BRDFS[name]).items()]
    counted = operations([brdf for _, _, brdf in materials], backend, device)
    context = open_context(backend, device)
    try:
        benches = {stage: Workload(context, stage, source(None, stage)) for stage in ("fragment", "vertex")}
        rows = []
        for (name, said, brdf), asked in zip(materials, counted, strict=True):
            took = {stage: bench.nanoseconds(source(brdf, stage), numbers(brdf), repeat) for stage, bench in benches.items()}
            rows.append(Cost(name, said, took["fragment"], took["vertex"], asked, size(brdf)))
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
    """Those that a software driver may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def table(found: Costs) -> list[tuple[str, ...]]:
    """Rows of text for people, the first the heading: model, ns a pixel and a vertex with their ranges, operations, bytes."""

    def ns(spread: Spread) -> tuple[str, str]:
        return f"{spread.median:6.2f}", f"{spread.low:.2f} to {spread.high:.2f}"

    rows: list[tuple[str, ...]] = [("model", " pixel", "range", "vertex", "range", " ops", "of these", "bytes")]
    for row in found.rows:
        name = f"{row.model} ({row.variant})" if row.variant else row.model
        counted = ("   -", "-") if row.operations is None else (f"{row.operations.total:4}", str(row.operations))
        rows.append((name, *ns(row.pixel), *ns(row.vertex), *counted, f"{row.size:5}"))
    return rows
