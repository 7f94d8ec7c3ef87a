"""Texts: small stages of GLSL, compiled and run on the CPU."""

from __future__ import annotations

import shutil
from typing import Any

import numpy as np
import pytest

from glshade.glsl.source import Stage
from glshade.spirv.arithmetic import FLOAT64, Arithmetic
from glshade.spirv.compiler import compiled
from glshade.spirv.machine import Result, run
from glshade.spirv.module import Module, StageName

needs_compiler = pytest.mark.skipif(
    shutil.which("glslangValidator") is None, reason="needs glslangValidator (apt install glslang-tools)"
)


def stage_of(text: str) -> Stage:
    """Returns a text as a stage, whose lines come from `stage.glsl`."""
    return Stage(text, tuple(("stage.glsl", number) for number in range(1, len(text.splitlines()) + 1)))


def module_of(text: str, name: StageName = "fragment") -> Module:
    """Returns the module of a text; `#version 330 core` is added before a text without a version."""
    return compiled(stage_of(text if text.startswith("#version") else f"#version 330 core\n{text}"), name)


def run_text(
    text: str, lanes: int = 1, arithmetic: Arithmetic = FLOAT64, squares: bool = False, **inputs: Any
) -> tuple[Any, Result]:
    """Runs a fragment stage and returns its output `o`, with the axis of lanes first, and the whole result."""
    result = run(module_of(text), inputs, lanes, arithmetic, squares=squares)
    return np.asarray(result.outputs["o"]), result


def expression(type_: str, text: str, declarations: str = "") -> str:
    """Returns a fragment stage whose output `o` is an expression of the inputs that the declarations name."""
    return f"{declarations}\nout {type_} o;\nvoid main() {{\n    o = {text};\n}}\n"
