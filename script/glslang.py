"""Has glslangValidator, a second compiler, read every program that the generator can make of one feature at a time.

python script/glslang.py: exit code 1 where it finds fault, 0 with a word of warning where it is not installed.
"""

from __future__ import annotations

import itertools
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import get_args

from glshade.assembly.assembly import assemble
from glshade.brdfs import BRDFS
from glshade.gl.evaluation import generated
from glshade.glsl.generator import Source, expand, generate
from glshade.glsl.plan import LightGroup, ProgramPlan, Viewer, plan
from glshade.lights import LIGHTS
from glshade.scene.file import load

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "tests"))

from extremes import at_extremes  # noqa: E402


def groups(count: int) -> tuple[LightGroup, ...]:
    """`count` lights of every kind, white and coloured; a page of each where it is 0."""
    found = []
    for name, cls in LIGHTS.items():
        falloffs = ("none", "1/r", "1/r^2") if "falloff" in cls.model_fields else ("none",)
        for falloff, white in itertools.product(() if cls.omnidirectional else falloffs, (False, True) if count else (False,)):
            found.append(LightGroup(name, falloff, white, count))
    return tuple(found)


def plans() -> Iterator[ProgramPlan]:
    """Every model at every rate with every light, and every other feature with one of them."""
    rates, viewers = ("flat", "gouraud", "phong"), get_args(Viewer)
    for (name, model), use in itertools.product(BRDFS.items(), ("uniform", "texture")):
        parameters = tuple((p, use) for p in model.parameters())
        if use == "texture":
            parameters = tuple(
                (p, use if model.is_colour(p) else f"{use}.{'rgba'[i % 4]}") for i, p in enumerate(model.parameters())
            )
        unused = tuple((p, "unused") for p in model.parameters())
        textured = parameters[0][0] if use == "texture" else None
        base = ProgramPlan(
            rate="phong",
            brdf=name,
            slots=tuple(model().slots().items()),
            parameters=parameters,
            lights=groups(1),
            ambient="varying",
            viewer="perspective",
            both_sides=False,
            alpha="opaque",
            alpha_from=None,
            vertex_colours=False,
            normal_map=False,
            anisotropic=model.anisotropic,
            encoding="srgb",
        )
        yield from (replace(base, slots=tuple(material.slots().items())) for material in at_extremes(name, 48))
        for rate, viewer, both in itertools.product(rates, viewers, (False, True)):
            one = replace(base, rate=rate, viewer=viewer, both_sides=both, encoding="linear")
            yield from (replace(one, lights=groups(count)) for count in (0, 1, 3))
            yield replace(one, ambient="constant", lights=groups(1)[:1])
            yield replace(one, normal_map=True, vertex_colours=True, alpha="mask", alpha_from=textured)
            yield replace(one, vertex_colours=True, alpha="blend", alpha_from=textured)
            yield replace(one, normal_map=True, normal_span=(2, 1))
            if use == "texture":
                yield replace(one, shared=tuple((p, parameters[0][0]) for p, _ in parameters[1:]))
            if model.anisotropic:
                for bumps, turned in itertools.product((False, True), repeat=2):
                    yield replace(one, normal_map=bumps, turned=turned, direction_map=True)
                yield replace(one, turned=True)
            if not both:
                yield replace(one, lights=())
                yield replace(one, lights=(), ambient="constant", parameters=unused)
                yield replace(one, lights=(), ambient="none", parameters=unused)
    for path in sorted((ROOT / "scenes").glob("*.toml")):
        for encoding in ("linear", "srgb"):
            yield from plan(assemble(load(path)), encoding).programs


def sources() -> Iterator[Source]:
    """The programs of plans, and the few that no plan describes."""
    yield from (generate(one) for one in dict.fromkeys(plans()))
    for encoding in ("linear", "srgb"):
        output = {"output": f'#include "output/{encoding}.glsl"\n'}
        yield Source(expand("pass/picture.vert", {}), expand("pass/picture.frag", output))
    for name in BRDFS:
        for text in {tuple(generated(material).items()): generated(material) for material in at_extremes(name, 48)}.values():
            yield Source(expand("pass/evaluate.vert", text), expand("pass/evaluate.frag", text))


def main() -> int:
    """Writes every distinct stage to a file and has them read in one go."""
    compiler = shutil.which("glslangValidator")
    if compiler is None:
        print("glslangValidator is not installed: no second compiler has read the shaders", file=sys.stderr)
        return 0
    stages = {}
    for source in sources():
        stages[source.vertex.text] = (source.vertex, "vert")
        if source.fragment:
            stages[source.fragment.text] = (source.fragment, "frag")
    with tempfile.TemporaryDirectory() as folder:
        files = {}
        for index, (text, (stage, suffix)) in enumerate(stages.items()):
            path = Path(folder) / f"{index}.{suffix}"
            path.write_text(text, encoding="utf-8")
            files[str(path)] = stage
        done = subprocess.run([compiler, "-t", *files], capture_output=True, text=True, check=False)
    faults = [line for line in done.stdout.splitlines() if line.startswith(("ERROR", "WARNING"))]
    current = None
    for line in done.stdout.splitlines():
        current = files.get(line.strip(), current)
        if line.startswith(("ERROR: 0:", "WARNING: 0:")) and current is not None:
            number, _, message = line.split(":", 2)[2].partition(":")
            print(f"{current.place(int(number))}:{message}")
    print(f"glslangValidator: {len(stages)} stages read, {len(faults)} complaints")
    return 1 if done.returncode or faults else 0


if __name__ == "__main__":
    sys.exit(main())
