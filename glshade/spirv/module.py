"""Module: a SPIR-V module as typed Python objects (Khronos, SPIR-V Specification, version 1.6)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, NamedTuple

StageName = Literal["vertex", "fragment"]
Kind = Literal[
    "void", "bool", "int", "float", "vector", "matrix", "array", "struct", "pointer", "image", "sampled image", "function"
]
# Where a variable lives. "uniform" holds sampler uniforms too, "block" holds uniform blocks.
Storage = Literal["uniform", "in", "out", "block", "private", "function"]


@dataclass(frozen=True)
class Type:
    """A type.

    kind: the kind.
    signed: True for a signed integer.
    element: the type of a component, column or array element, or the type that a pointer points to; None for other kinds.
    count: the number of components of a vector, columns of a matrix, or elements of an array; 0 for other kinds.
    members: the types of a struct's members.
    names: the names of a struct's members, empty where the module gives none.
    name: the name of a struct.
    """

    kind: Kind
    signed: bool = False
    element: Type | None = None
    count: int = 0
    members: tuple[Type, ...] = ()
    names: tuple[str, ...] = ()
    name: str = ""

    def __str__(self) -> str:
        if self.kind == "vector":
            letter = {"float": "", "int": "i", "bool": "b"}[str(self.element.kind)] if self.element else ""
            return f"{letter}vec{self.count}"
        if self.kind == "matrix" and self.element:
            same = self.count == self.element.count
            return f"mat{self.count}" if same else f"mat{self.count}x{self.element.count}"
        if self.kind == "array":
            return f"{self.element}[{self.count}]"
        return self.name or self.kind

    @cached_property
    def scalar(self) -> Type:
        """The type of one number of a scalar, vector or matrix."""
        return self.element.scalar if self.kind in ("vector", "matrix") and self.element else self

    @property
    def is_float(self) -> bool:
        """Whether values are floats, or vectors or matrices of floats."""
        return self.scalar.kind == "float"


class Instruction(NamedTuple):
    """An instruction of a function.

    name: the name in the specification, without its prefix "Op", such as FAdd.
    operands: the remaining words; which of them are ids depends on the instruction.
    line: the line of the GLSL text that it came from, counted from 1; 0 where the module does not say.
    type: the type of the result; None where there is no result.
    result: the id of the result; 0 where there is none.
    """

    name: str
    operands: tuple[int, ...]
    line: int
    type: Type | None = None
    result: int = 0


@dataclass(frozen=True)
class Block:
    """Instructions that are run one after another. The last one says which block follows.

    id: the id of the block's label.
    instructions: the instructions.
    """

    id: int
    instructions: tuple[Instruction, ...]


@dataclass(frozen=True)
class Function:
    """A function.

    id: its id.
    name: its name in GLSL, without parameters.
    type: the type of its result.
    parameters: the ids of its parameters.
    types: the types of its parameters; for one that the function may change, a pointer.
    blocks: its blocks, in the order of the module; the first one is run first.
    """

    id: int
    name: str
    type: Type
    parameters: tuple[int, ...]
    types: tuple[Type, ...]
    blocks: tuple[Block, ...]

    @property
    def instructions(self) -> Iterator[Instruction]:
        """Yields the instructions of all blocks."""
        for block in self.blocks:
            yield from block.instructions


@dataclass(frozen=True)
class Variable:
    """A global variable.

    id: its id.
    name: its name in GLSL; for a uniform block or a block without a name, the name of the block.
    storage: where it lives.
    type: its type.
    initial: the id of the constant that it starts with; 0 for none.
    """

    id: int
    name: str
    storage: Storage
    type: Type
    initial: int = 0


@dataclass(frozen=True)
class Module:
    """A module with one entry point.

    stage: the stage of the entry point.
    entry: the id of the entry point's function.
    functions: id -> function.
    variables: the global variables.
    constants: id -> (type, value). The value is a Python number, or a tuple of such values for a vector, matrix, array or
        struct; None is zero of any type.
    library: the id of the extended instruction set GLSL.std.450; 0 where it is not used.
    names: id -> name in GLSL, of variables within functions and of parameters.
    """

    stage: StageName
    entry: int
    functions: dict[int, Function]
    variables: tuple[Variable, ...]
    constants: dict[int, tuple[Type, Any]]
    library: int
    names: dict[int, str]

    def variable(self, name: str) -> Variable | None:
        """Returns the global variable of a name; None if there is none."""
        return next((variable for variable in self.variables if variable.name == name), None)
