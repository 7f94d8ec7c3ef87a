"""Checks that a program uses everything that it declares."""

from __future__ import annotations

import re

from glshade import Renderer
from glshade.gl.program import Program
from glshade.glsl.generator import generate
from glshade.glsl.plan import ProgramPlan


def declared(stage: str, kind: str) -> set[str]:
    """Returns the names that a stage declares with `kind`, which is uniform or in."""
    return set(re.findall(rf"^{kind} \w+ (\w+)(?:\[\d+\])?;", stage, re.M))


def nothing_unused(plan: ProgramPlan, renderer: Renderer) -> None:
    """Asserts that each uniform and input that the plan's program declares is active."""
    found = generate(plan)
    assert found.fragment is not None
    with renderer.context.gl:
        program = Program(renderer.context, found)
    uniforms = {re.sub(r"[\[.].*", "", name) for name in program.uniforms}
    assert declared(found.vertex.text + found.fragment.text, "uniform") == uniforms, plan
    assert declared(found.vertex.text, "in") == set(program.attributes), plan
