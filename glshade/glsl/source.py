"""Source: the text of a program, the file and line that each of its lines came from, and the variables that it declares."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, TypeAlias

Storage = Literal["uniform", "block", "in", "out"]
_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)


@dataclass(frozen=True)
class Declaration:
    """A global variable of a stage that the application or another stage sees.

    storage: uniform, block (a uniform block), in or out.
    type: the GLSL type; empty for a block.
    name: the name in the text; for a block, the name of the block.
    count: the length of an array, 0 for a single value.
    qualifier: the interpolation of an input or output: flat, centroid or empty.
    """

    storage: Storage
    type: str
    name: str
    count: int = 0
    qualifier: str = ""

    def __str__(self) -> str:
        """Returns the declaration as a line of GLSL; for a block, its first line."""
        if self.storage == "block":
            return f"layout(std140) uniform {self.name} {{"
        array = f"[{self.count}]" if self.count else ""
        return " ".join(filter(None, [self.qualifier, self.storage, self.type, f"{self.name}{array};"]))


@dataclass(frozen=True)
class Include:
    """An include of a shader file, which adds the file's text unless the stage already has it.

    name: the name of the file below the shader folders.
    """

    name: str


# A line of GLSL text, a declaration or an include. The lines that follow a block's declaration are text.
Entry: TypeAlias = "str | Declaration | Include"


@dataclass
class Code:
    """Generated GLSL.

    entries: lines of text, declarations and includes, in their order.
    """

    entries: list[Entry] = field(default_factory=list)

    def __bool__(self) -> bool:
        return bool(self.entries)

    def add(self, text: str) -> Code:
        """Adds lines of text, which must not declare global variables."""
        self.entries += text.splitlines()
        return self

    def include(self, *names: str) -> Code:
        """Adds includes of shader files, given by their names below the shader folders."""
        self.entries += map(Include, names)
        return self

    def uniform(self, type_: str, name: str, count: int = 0) -> Code:
        """Adds a uniform, or an array of `count` values where count is not 0."""
        self.entries.append(Declaration("uniform", type_, name, count))
        return self

    def input(self, type_: str, name: str, qualifier: str = "") -> Code:
        """Adds an input: a vertex attribute in the vertex stage, an output of the vertex stage in the fragment stage."""
        self.entries.append(Declaration("in", type_, name, qualifier=qualifier))
        return self

    def output(self, type_: str, name: str, qualifier: str = "") -> Code:
        """Adds an output of the vertex stage, which the fragment stage reads."""
        self.entries.append(Declaration("out", type_, name, qualifier=qualifier))
        return self

    def block(self, name: str, members: str) -> Code:
        """Adds a uniform block in the std140 layout. members: the lines that declare its members."""
        self.entries.append(Declaration("block", "", name))
        return self.add(f"{members}}};")

    def join(self, other: Code) -> Code:
        """Appends other code."""
        self.entries += other.entries
        return self


@dataclass(frozen=True)
class Stage:
    """The text of one stage.

    text: the GLSL with all includes in place.
    lines: (file, line number from 1) that each line of the text came from; the file of generated text is `<place>`.
    declared: (index of the line in the text, declaration) of the global variables; for a block, the index of its first line.
    """

    text: str
    lines: tuple[tuple[str, int], ...]
    declared: tuple[tuple[int, Declaration], ...] = ()

    def __hash__(self) -> int:
        # A string caches its hash; the default hash of all fields would walk over every line for every object of a scene.
        return hash(self.text)

    def place(self, line: int) -> str:
        """Returns the origin of a line of the text (counted from 1), as `file:line`. Lines beyond the end count as the last
        one.
        """
        file, number = self.lines[min(max(line, 1), len(self.lines)) - 1]
        return f"{file}:{number}"

    def declarations(self, storage: Storage) -> Iterator[Declaration]:
        """Returns the global variables of one storage, in the order of the text."""
        return (declaration for _, declaration in self.declared if declaration.storage == storage)

    def only(self, kept: list[int]) -> Stage:
        """Returns the stage reduced to the lines at these indices, which must ascend."""
        text = self.text.splitlines()
        place = {line: index for index, line in enumerate(kept)}
        return Stage(
            "".join(f"{text[i]}\n" for i in kept),
            tuple(self.lines[i] for i in kept),
            tuple((place[line], declaration) for line, declaration in self.declared if line in place),
        )


@dataclass(frozen=True)
class Source:
    """The text of a program.

    vertex: the vertex stage.
    fragment: the fragment stage; None if transform feedback captures the output of the vertex stage.
    """

    vertex: Stage
    fragment: Stage | None

    @property
    def stages(self) -> tuple[Stage, ...]:
        """The vertex stage, and the fragment stage if there is one."""
        return (self.vertex,) if self.fragment is None else (self.vertex, self.fragment)

    @cached_property
    def code(self) -> tuple[str, ...]:
        """The texts of the stages without comments, indentation and empty lines. Equal code makes equal programs."""
        return tuple(_without_comments(stage.text) for stage in self.stages)

    @cached_property
    def files(self) -> frozenset[str]:
        """The paths of the shader files that the lines came from."""
        named = {file for stage in self.stages for file, _ in stage.lines}
        return frozenset(file for file in named if not file.startswith("<"))


def _without_comments(text: str) -> str:
    """GLSL without comments, indentation and empty lines."""
    lines = map(str.strip, _COMMENT.sub(" ", text).splitlines())
    return "\n".join(line for line in lines if line)


# A function that is applied to every source before it is compiled.
Rewrite: TypeAlias = Callable[[Source], Source]
