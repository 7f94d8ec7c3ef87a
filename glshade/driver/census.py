"""Census: the operations of a program's stages, counted in the driver's own intermediate code.

Mesa's Gallium drivers (llvmpipe, radeonsi, iris, zink and others) print the NIR of a stage, linked and optimised, when the
environment variable ST_DEBUG asks for it, in release builds too. It is read once when a driver is loaded, so the programs are
compiled in a process of their own. Other drivers say nothing.
"""

from __future__ import annotations

import os
import pickle
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from glshade.gl.context import Backend
    from glshade.glsl.generator import Source

# Without the cache on disk: what comes from there is not compiled, and need not be printed.
ENVIRONMENT = {"ST_DEBUG": "nir", "MESA_SHADER_CACHE_DISABLE": "true"}
# A start, a context and a few hundred programs; a driver that hangs is given up.
SECONDS = 300

# kind -> NIR's operations, as regular expressions of the whole name without the size at its end ("flt32" is "flt").
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
# Cost nothing, or ride on another operation.
FREE = re.compile(r"mov|vec\d+|fneg|fabs|fcanonicalize|(un)?pack_.*|load_const|(ssa_)?undef(ined)?")
_KINDS = {kind: re.compile(names) for kind, names in KINDS.items()}

# `vec3 32 ssa_7 = fmul ...` to Mesa 22, `div 32x3  %7 = fmul ...` since.
_SIZE = r"(?:(?:con|div)\s+)?(?:vec(?P<old>\d+)\s+)?\d+(?:x(?P<new>\d+))?\s+"
_VALUE = re.compile(rf"^\s*(?:{_SIZE})?(?:ssa_|%|r)\d+.*?\s=\s+(?P<what>.*)$")
_TEXTURE = re.compile(r"^\([a-z]+\d+\)\s*(?P<name>\w+)")
_DOT = re.compile(r"fdot(\d+)")
_STAGE = re.compile(r"^shader: MESA_SHADER_(?P<name>\w+)")
_MARK = "census of program "


@dataclass(frozen=True)
class Operations:
    """What a stage's text asks for, each component of a vector counted. A loop's body counts once.

    arithmetic: kind -> count, in the order of KINDS; div has reciprocals, sqrt inverse roots, exp the logarithm, power, sine
    and cosine, select every comparison, minimum and maximum, int conversions, other rounding and the like. Negations and
    absolute values are free.
    """

    arithmetic: Mapping[str, int] = field(default_factory=lambda: dict.fromkeys(KINDS, 0))
    textures: int = 0
    branches: int = 0
    loops: int = 0

    @property
    def total(self) -> int:
        """All arithmetic."""
        return sum(self.arithmetic.values())

    def __sub__(self, other: Operations) -> Operations:
        kinds = {kind: count - other.arithmetic[kind] for kind, count in self.arithmetic.items()}
        rest = (getattr(self, name) - getattr(other, name) for name in ("textures", "branches", "loops"))
        return Operations(kinds, *rest)

    def as_dict(self) -> dict[str, int]:
        """For JSON: kind -> count, and their total."""
        rest = {"textures": self.textures, "branches": self.branches, "loops": self.loops}
        return {**self.arithmetic, **rest, "total": self.total}

    def __str__(self) -> str:
        parts = {**self.arithmetic, "texture": self.textures, "branch": self.branches, "loop": self.loops}
        return ", ".join(f"{count} {kind}" for kind, count in parts.items() if count) or "nothing"


@dataclass(frozen=True)
class Census:
    """The operations of a program. A stage that the program has not is None."""

    vertex: Operations | None
    fragment: Operations | None

    def as_dict(self) -> dict[str, dict[str, int] | None]:
        """For JSON."""
        return {
            stage: None if found is None else found.as_dict()
            for stage, found in (("vertex", self.vertex), ("fragment", self.fragment))
        }


def census(source: Source, backend: Backend = "auto", device: int | None = None) -> Census | None:
    """The operations of one program; None where the driver shows nothing. A process is started for it: see `censuses`."""
    return censuses([source], backend, device)[0]


def censuses(sources: Sequence[Source], backend: Backend = "auto", device: int | None = None) -> list[Census | None]:
    """The same of many programs, from one process.

    backend, device: as of `open_context`. Errors: ShaderError for a source that does not compile, ContextError,
    GlshadeError where the process ends otherwise.
    """
    from glshade.errors import ContextError, GlshadeError, ShaderError

    command = [sys.executable, "-m", "glshade.driver.census"]
    given = pickle.dumps((list(sources), backend, device))
    try:
        done = subprocess.run(command, input=given, capture_output=True, env={**os.environ, **ENVIRONMENT}, timeout=SECONDS)
    except subprocess.TimeoutExpired:
        raise GlshadeError(f"the driver took more than {SECONDS} s to show what it makes of the programs") from None
    if done.returncode:
        kinds = {4: ShaderError, 5: ContextError}
        message = done.stdout.decode(errors="replace").strip()
        kind = kinds.get(done.returncode, GlshadeError)
        raise kind(message or f"no census: the process that compiles ended with exit code {done.returncode}")
    # What stands before the first mark belongs to no program: drivers compile some of their own.
    parts = done.stderr.decode(errors="replace").split(_MARK)[1:]
    return [count(part) for part in parts]


def count(printed: str) -> Census | None:
    """The operations of what a Gallium driver printed of one program; None where that is nothing."""
    stages: dict[str, Operations] = {}
    for name, lines in _stages(printed):
        # Of several variants of a stage the first is the one that the program was linked to.
        stages.setdefault(name, _operations(lines))
    return Census(stages.get("VERTEX"), stages.get("FRAGMENT")) if stages else None


def _stages(printed: str) -> Iterator[tuple[str, list[str]]]:
    """(name, lines) of each stage that is printed."""
    name, lines = "", list[str]()
    for line in printed.splitlines():
        head = _STAGE.match(line)
        # A driver without NIR is handed something else, printed after it.
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
        if _TEXTURE.match(value["what"]):
            textures += 1
            continue
        # Without the marks of exactness: "fadd!", "fmul.nsz".
        name = re.split(r"[!.\s]", value["what"], maxsplit=1)[0]
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
    """The kind of an operation by its name in NIR."""
    bare = re.sub(r"(?<=[a-z])(1|8|16|32|64)$", "", name)
    return next(kind for kind, names in _KINDS.items() if names.fullmatch(bare) or names.fullmatch(name))


def _child() -> int:
    """Compiles what comes through stdin; the driver prints on stderr, between marks."""
    from glshade.errors import GlshadeError
    from glshade.gl.context import open_context
    from glshade.gl.program import Program

    sources, backend, device = pickle.load(sys.stdin.buffer)
    try:
        context = open_context(backend, device)
        for number, source in enumerate(sources):
            # Straight to the file, as the driver prints.
            os.write(2, f"\n{_MARK}{number}\n".encode())
            Program(context, source)
        context.release()
    except GlshadeError as error:
        print(error)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(_child())
