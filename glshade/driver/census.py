"""Census: counts the operations of a program's stages in the driver's own intermediate code.

NIR is the intermediate code of Mesa's compiler. Mesa's Gallium drivers (llvmpipe, radeonsi, iris, zink and others) print the
NIR of a stage after linking and optimisation if the environment variable ST_DEBUG asks for it, in release builds too. They read
the variable only once, when the driver is loaded. So the programs are compiled in a process of their own. Other drivers print
nothing.
"""

from __future__ import annotations

import os
import pickle
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from glshade.errors import ContextError, GlshadeError, ShaderError

if TYPE_CHECKING:
    from glshade.gl.context import Backend
    from glshade.glsl.explanation import Explained, Explanation
    from glshade.glsl.source import Source

# Mesa's cache on disk is turned off, because a program from the cache is not compiled and may not be printed.
ENVIRONMENT = {"ST_DEBUG": "nir", "MESA_SHADER_CACHE_DISABLE": "true"}
# Timeout of the process that compiles programs [s]. A few hundred programs take much less.
SECONDS = 300

# kind -> a regular expression for the names of its operations in NIR. It matches the whole name without the size in bits, such
# as "flt" for "flt32".
KINDS: Mapping[str, str] = {
    "add": "fadd|fsub|fsum.*",
    "mul": "fmul|fmulz",
    "fma": "ffma|ffmaz|fmad|flrp",
    "div": "fdiv|frcp|fmod|frem",
    "sqrt": "fsqrt|frsq",
    "exp": "fexp2|flog2|fpow|fsin.*|fcos.*",
    "select": "[bfi]?\\d*csel.*|[fiu](min|max)3?|[fiu](lt|ge|eq|ne|neu|ltu|equ)[us]?|fsat.*|fsign|s(lt|ge|eq|ne)|[bfi]2b|b2[fi]"
    "|b(all|any)_.*",
    "int": "[iu](add|sub|mul|div|mod|rem|neg|abs|and|or|xor|not|shl|shr|sign).*|ushr|ishl|ishr|[fiu]2[fiu].*|bfm|bfi"
    "|[iu]bfe|bitfield.*|extract.*|insert.*|find.*|bit_count",
    "other": ".*",
}
# These operations cost nothing or are folded into another one.
FREE = re.compile(r"mov|vec\d+|fneg|fabs|fcanonicalize|(un)?pack_.*|load_const|(ssa_)?undef(ined)?")
_KINDS = {kind: re.compile(names) for kind, names in KINDS.items()}

# A line of an operation looks like `vec3 32 ssa_7 = fmul ...` up to Mesa 22, and like `div 32x3  %7 = fmul ...` in later
# versions.
_SIZE = r"(?:(?:con|div)\s+)?(?:vec(?P<old>\d+)\s+)?\d+(?:x(?P<new>\d+))?\s+"
_VALUE = re.compile(rf"^\s*(?:{_SIZE})?(?:ssa_|%|r)\d+.*?\s=\s+(?P<operation>.*)$")
_TEXTURE = re.compile(r"^\([a-z]+\d+\)\s*(?P<name>\w+)")
_DOT = re.compile(r"fdot(\d+)")
_STAGE = re.compile(r"^shader: MESA_SHADER_(?P<name>\w+)")
_MARK = "census of program "


@dataclass(frozen=True)
class Operations:
    """The operations of a stage. Each component of a vector counts as one operation. The body of a loop is counted once.

    arithmetic: kind -> count, in the order of KINDS. "div" includes reciprocals; "sqrt" includes inverse roots; "exp" includes
        logarithms, powers, sines and cosines; "select" includes comparisons, minima and maxima; "int" includes conversions.
        "other" counts rounding and all operations of no other kind. Negations and absolute values are not counted.
    textures: the number of texture lookups.
    branches: the number of if statements.
    loops: the number of loops.
    """

    arithmetic: Mapping[str, int] = field(default_factory=lambda: dict.fromkeys(KINDS, 0))
    textures: int = 0
    branches: int = 0
    loops: int = 0

    @property
    def total(self) -> int:
        """The number of arithmetic operations of all kinds."""
        return sum(self.arithmetic.values())

    def __sub__(self, other: Operations) -> Operations:
        kinds = {kind: count - other.arithmetic[kind] for kind, count in self.arithmetic.items()}
        rest = (getattr(self, name) - getattr(other, name) for name in ("textures", "branches", "loops"))
        return Operations(kinds, *rest)

    def as_dict(self) -> dict[str, int]:
        """Returns the counts ready for JSON: kind -> count, then textures, branches, loops and the total of all kinds."""
        rest = {"textures": self.textures, "branches": self.branches, "loops": self.loops}
        return {**self.arithmetic, **rest, "total": self.total}

    def __str__(self) -> str:
        parts = {**self.arithmetic, "texture": self.textures, "branch": self.branches, "loop": self.loops}
        return ", ".join(f"{count} {kind}" for kind, count in parts.items() if count) or "nothing"


@dataclass(frozen=True)
class Census:
    """The operations of a program.

    vertex: the operations of the vertex stage; None if the program has no such stage.
    fragment: the operations of the fragment stage; None if the program has no such stage.
    """

    vertex: Operations | None
    fragment: Operations | None

    def as_dict(self) -> dict[str, dict[str, int] | None]:
        """Returns the census ready for JSON: stage -> counts, or None."""
        return {
            stage: None if found is None else found.as_dict()
            for stage, found in (("vertex", self.vertex), ("fragment", self.fragment))
        }


def censuses(sources: Sequence[Source], backend: Backend = "auto", device: int | None = None) -> list[Census | None]:
    """Returns the census of each program; None for programs about which the driver prints nothing.

    One process compiles all programs.
    backend, device: the arguments of `open_context`.
    Errors: ShaderError for a source that does not compile; ContextError; GlshadeError if the process fails otherwise.
    """
    command = [sys.executable, "-m", "glshade.driver.census"]
    given = pickle.dumps((list(sources), backend, device))
    try:
        done = subprocess.run(command, input=given, capture_output=True, env={**os.environ, **ENVIRONMENT}, timeout=SECONDS)
    except subprocess.TimeoutExpired:
        raise GlshadeError(f"the driver took more than {SECONDS} s to compile the programs") from None
    if done.returncode:
        error = {4: ShaderError, 5: ContextError}.get(done.returncode, GlshadeError)
        message = done.stdout.decode(errors="replace").strip()
        raise error(message or f"the process that compiles programs ended with exit code {done.returncode}")
    # The text before the first mark is about programs that the driver itself uses.
    parts = done.stderr.decode(errors="replace").split(_MARK)[1:]
    return [count(part) for part in parts]


def count(printed: str) -> Census | None:
    """Counts the operations in the text that a Gallium driver printed about one program. Returns None if it has no stage."""
    stages: dict[str, Operations] = {}
    for name, lines in _stages(printed):
        # A driver may print variants of a stage later. The first text of a stage is that of the linked program.
        stages.setdefault(name, _operations(lines))
    return Census(stages.get("VERTEX"), stages.get("FRAGMENT")) if stages else None


def _stages(printed: str) -> Iterator[tuple[str, list[str]]]:
    """Yields (name, lines) of each stage in the text."""
    name, lines = "", list[str]()
    for line in printed.splitlines():
        head = _STAGE.match(line)
        # For a driver that does not accept NIR, Mesa translates the NIR to TGSI and prints that after the stage.
        if head or line.startswith("TGSI"):
            if name:
                yield name, lines
            name, lines = head["name"] if head else "", []
        lines.append(line)
    if name:
        yield name, lines


def _operations(lines: list[str]) -> Operations:
    arithmetic: Counter[str] = Counter()
    textures = branches = loops = 0
    for line in lines:
        word = line.strip()
        branches += word.startswith("if ")
        loops += word.startswith("loop {") or word == "loop"
        value = _VALUE.match(line)
        if value is None:
            continue
        if _TEXTURE.match(value["operation"]):
            textures += 1
            continue
        # A name may end in a mark about exactness, as in "fadd!" and "fmul.nsz". The mark is removed.
        name = re.split(r"[!.\s]", value["operation"], maxsplit=1)[0]
        width = int(value["old"] or value["new"] or 1)
        if name in {"intrinsic", "phi", "deref_var", "deref_array", "deref_struct"} or name.startswith(("@", "deref")):
            continue
        dot = _DOT.match(name)
        if dot:
            arithmetic["mul"] += int(dot[1])
            arithmetic["add"] += int(dot[1]) - 1
        elif not FREE.fullmatch(name):
            arithmetic[_kind(name)] += width
    return Operations({kind: arithmetic[kind] for kind in KINDS}, textures, branches, loops)


def _kind(name: str) -> str:
    """Returns the kind of an operation with that name in NIR."""
    bare = re.sub(r"(?<=[a-z])(1|8|16|32|64)$", "", name)
    return next(kind for kind, names in _KINDS.items() if names.fullmatch(bare) or names.fullmatch(name))


def with_operations(found: Explanation, backend: Backend = "auto", device: int | None = None) -> Explanation:
    """Returns the explanation with the operations of each program, if the driver prints them. Errors: as for `censuses`."""
    counted = censuses([program.source for program in found.programs], backend, device)

    def completed(program: Explained, operations: Census | None) -> Explained:
        return replace(program, operations=operations.as_dict() if operations else None)

    return replace(found, programs=tuple(map(completed, found.programs, counted)))


def _child() -> int:
    """Compiles the programs that come through stdin, and returns the exit code.

    The driver prints the operations to stderr. This function prints a mark there before each program.
    """
    from glshade.gl.context import open_context
    from glshade.gl.program import Program

    sources, backend, device = pickle.load(sys.stdin.buffer)
    try:
        context = open_context(backend, device)
        for number, source in enumerate(sources):
            # The driver writes to the file descriptor directly. A mark in a buffer of Python would come too late.
            os.write(2, f"\n{_MARK}{number}\n".encode())
            Program(context, source)
        context.release()
    except GlshadeError as error:
        print(error)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(_child())
