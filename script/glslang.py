"""Checks generated programs, which between them have every feature, with a second compiler, glslangValidator.

python script/glslang.py: the exit code is 1 if it complains. If it is not installed, the exit code is 0, with a warning.
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
from glshade.glsl.coverage import every_light, plan_of_model
from glshade.glsl.generator import generate, value_code
from glshade.glsl.plan import ProgramPlan, Use, Viewer
from glshade.glsl.planner import plan
from glshade.glsl.shaders import SHIPPED, expand
from glshade.glsl.source import Code, Source, Stage
from glshade.scene.file import load

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "tests"))

from support.extremes import at_extremes  # noqa: E402


def plans() -> Iterator[ProgramPlan]:
    """Plans of every model at every rate with every light, plans with each other feature, and those of the shipped scenes."""
    rates, viewers = ("flat", "gouraud", "phong"), get_args(Viewer)
    uses: tuple[Use, ...] = ("uniform", "texture")
    for (name, model), use in itertools.product(BRDFS.items(), uses):
        base = plan_of_model(name, use)
        unused = tuple((p, "unused") for p in model.parameters())
        textured = base.parameters[0][0] if use == "texture" else None
        yield from (replace(base, slots=tuple(material.slots().items())) for material in at_extremes(name, 48))
        for rate, viewer, both in itertools.product(rates, viewers, (False, True)):
            one = replace(base, rate=rate, viewer=viewer, both_sides=both, encoding="linear")
            yield from (replace(one, lights=every_light(count)) for count in (0, 1, 3))
            yield replace(one, ambient="constant", lights=every_light(1)[:1])
            yield replace(one, normal_map=True, vertex_colours=True, alpha="mask", alpha_from=textured)
            yield replace(one, vertex_colours=True, alpha="blend", alpha_from=textured)
            yield replace(one, normal_map=True, normal_span=(2, 1))
            if textured:
                placed = (f"u_{textured}_texture", "u_normal_map", "u_direction_map")
                yield replace(one, normal_map=True, direction_map=model.anisotropic, placed=placed, added=(textured,))
                yield replace(one, shared=tuple((p, base.parameters[0][0]) for p, _ in base.parameters[1:]))
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
    """Yields the sources of all plans, and of the few programs that have no plan."""
    yield from (generate(one) for one in dict.fromkeys(plans()))
    for encoding in ("linear", "srgb"):
        output = {"output": Code().include(f"output/{encoding}.glsl")}
        yield Source(expand("pass/picture.vert", {}), expand("pass/picture.frag", output))
    for name in BRDFS:
        for material in at_extremes(name, 48):
            code = value_code(material)
            # main() drops stages that are equal.
            yield Source(expand("pass/evaluate.vert", code), expand("pass/evaluate.frag", code))


def driver_stages() -> Iterator[tuple[Stage, str]]:
    """Yields the stages that measure the driver, with their suffixes: each for both versions of GLSL that they are
    compiled in.
    """
    for path in sorted((SHIPPED / "driver").iterdir()):
        if path.suffix in (".vert", ".frag"):
            for version in ("330", "400"):
                generated = {"version": f"#version {version} core\n"}
                yield expand(f"driver/{path.name}", generated), path.suffix.removeprefix(".")


def main() -> int:
    """Checks every distinct stage in a single run of the compiler. Returns the exit code."""
    compiler = shutil.which("glslangValidator")
    if compiler is None:
        print("glslangValidator is not installed: no second compiler has read the shaders", file=sys.stderr)
        return 0
    stages = {}
    for source in sources():
        stages[source.vertex.text] = (source.vertex, "vert")
        if source.fragment:
            stages[source.fragment.text] = (source.fragment, "frag")
    stages |= {stage.text: (stage, suffix) for stage, suffix in driver_stages()}
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
