"""Compiler: turns the text of a stage into SPIR-V by glslangValidator, the reference compiler of Khronos."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from functools import lru_cache
from pathlib import Path

from glshade.errors import MissingLibrary, ShaderError
from glshade.glsl.source import Stage
from glshade.spirv.module import Module, StageName
from glshade.spirv.reader import read

SUFFIXES: dict[StageName, str] = {"vertex": "vert", "fragment": "frag"}
# The compiler needs 30 ms for the longest stage of the shipped scenes. A text that takes longer than this may never end [s].
PATIENCE = 30.0


def compiled(stage: Stage, name: StageName) -> Module:
    """Returns the module of a stage. Each instruction carries the line of the stage's text that it came from.

    Errors: MissingLibrary where glslangValidator is not installed; ShaderError where it refuses the text, with the file and
    line of the first complaint, and where the module holds what the machine cannot run.
    """
    binary, complaint = _binary(stage.text, name)
    if complaint is not None:
        line, message = complaint
        raise ShaderError(f"{stage.place(line)}: {message} (glslangValidator)")
    return read(binary, stage.place)


@lru_cache(maxsize=256)
def _binary(text: str, name: StageName) -> tuple[bytes, tuple[int, str] | None]:
    """Returns (SPIR-V, None), or (no bytes, (line, message)) where the compiler refuses the text. Errors: MissingLibrary."""
    compiler = shutil.which("glslangValidator")
    if compiler is None:
        raise MissingLibrary("glslangValidator is not installed: apt install glslang-tools")
    with tempfile.TemporaryDirectory(prefix="glshade-") as folder:
        source, result = Path(folder) / f"stage.{SUFFIXES[name]}", Path(folder) / "stage.spv"
        source.write_text(text, encoding="utf-8")
        # OpenGL's rules for SPIR-V demand numbers for uniforms and varyings, which GLSL 3.30 does not have: the compiler gives
        # them. -g keeps the lines. -Od keeps the operations as they are written.
        options = ["-G", "--aml", "--amb", "-g", "-Od", "-o", str(result)]
        try:
            done = subprocess.run(
                [compiler, *options, str(source)], capture_output=True, text=True, check=False, timeout=PATIENCE
            )
        except subprocess.TimeoutExpired:
            return b"", (1, f"the compiler does not end within {PATIENCE:g} s")
        if done.returncode == 0 and result.is_file():
            return result.read_bytes(), None
        return b"", _complaint(done.stdout)


def _complaint(output: str) -> tuple[int, str]:
    """Returns the line and the text of the compiler's first complaint."""
    for line in output.splitlines():
        # Such as "ERROR: stage.frag:12: 'x' : undeclared identifier", or "ERROR: 0:12: ...".
        head, _, rest = line.partition(": ")
        if head != "ERROR":
            continue
        place, _, message = rest.partition(": ")
        number = place.rpartition(":")[2]
        return (int(number), message.strip()) if number.isdecimal() else (1, rest.strip())
    return 1, "the compiler fails without a message"
