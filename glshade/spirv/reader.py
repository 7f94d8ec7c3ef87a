"""Reader: reads SPIR-V binaries into modules, and refuses what the machine cannot run, naming the GLSL line."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from typing import Any

from glshade.errors import ShaderError, printable
from glshade.spirv.module import Block, Function, Instruction, Module, StageName, Type, Variable
from glshade.spirv.opcodes import (
    ABOUT_THE_MODULE,
    CONSTANTS,
    OF_FUNCTIONS,
    STAGES,
    STORAGES,
    TERMINATORS,
    TYPES,
    WITH_RESULT,
    WITHOUT_EFFECT,
    WITHOUT_RESULT,
)

# The first word of a module, and the words before the first instruction.
MAGIC, HEADER = 0x07230203, 5
# No module may have more ids, words or array elements than this. The longest stage of the shipped scenes has 3,000 ids and
# 20,000 words; GLSL guarantees uniform blocks of 16 KiB, hence arrays of 4,096 numbers.
MOST_IDS, MOST_WORDS, MOST_ELEMENTS = 1 << 20, 1 << 24, 1 << 16
# The width of numbers: doubles and 16-bit numbers are not part of GLSL 3.30.
WIDTH = 32

# Returns the place, as file:line, of a line of a stage's text.
Place = Callable[[int], str]


def read(binary: bytes, place: Place = lambda line: f"line {line}") -> Module:
    """Returns the module that a binary holds.

    place: turns a line of the GLSL text into the place that messages name.
    Errors: ShaderError for a binary that is damaged, or that holds an instruction, a type or a built-in that cannot be run.
    """
    reader = _Reader(place)
    try:
        for code, operands in _instructions(binary):
            reader.take(code, operands)
        return reader.module()
    except (IndexError, KeyError, struct.error) as error:
        raise ShaderError(f"{reader.where()}: the SPIR-V module is damaged: {error.args[0] if error.args else error}") from None


def _instructions(binary: bytes) -> Iterator[tuple[int, tuple[int, ...]]]:
    """Yields (opcode, operands) of every instruction. Errors: ShaderError."""
    count = len(binary) // 4
    if len(binary) % 4 or not HEADER <= count <= MOST_WORDS:
        raise ShaderError(f"the SPIR-V module is damaged: it has {len(binary)} bytes")
    words = struct.unpack(f"<{count}I", binary)
    if words[0] != MAGIC:
        raise ShaderError(f"the SPIR-V module is damaged: it starts with {words[0]:#010x}, not {MAGIC:#010x}")
    if words[3] > MOST_IDS:
        raise ShaderError(f"the SPIR-V module declares {words[3]:,} ids; {MOST_IDS:,} are read")
    at = HEADER
    while at < count:
        length, code = words[at] >> 16, words[at] & 0xFFFF
        if length == 0 or at + length > count:
            raise ShaderError("the SPIR-V module is damaged: it ends within an instruction")
        yield code, words[at + 1 : at + length]
        at += length


def _text(words: tuple[int, ...]) -> str:
    """Returns the text that starts with the first word. Errors: IndexError where it has no end."""
    text, end, _ = struct.pack(f"<{len(words)}I", *words).partition(b"\0")
    if not end:
        raise IndexError("a text has no end")
    return printable(text.decode("utf-8", errors="replace"))


class _Reader:
    """The parts of a module that have been read so far."""

    def __init__(self, place: Place) -> None:
        self._place = place
        self._line = 0
        self._names: dict[int, str] = {}
        # struct -> member -> name
        self._member_names: dict[int, dict[int, str]] = {}
        self._types: dict[int, Type] = {}
        self._constants: dict[int, tuple[Type, Any]] = {}
        self._variables: list[Variable] = []
        self._functions: dict[int, Function] = {}
        self._library = 0
        # (stage, id of the function) of the entry point.
        self._entry: tuple[StageName, int] | None = None
        # The function that is being read: (id, type of its result), parameters, blocks, and the block that is being read.
        self._head: tuple[int, Type] | None = None
        self._parameters: list[tuple[int, Type]] = []
        self._blocks: list[Block] = []
        self._label = 0
        self._body: list[Instruction] | None = None

    def where(self) -> str:
        """Returns the place of the GLSL line that is being read."""
        return self._place(self._line) if self._line else "shader"

    def take(self, code: int, operands: tuple[int, ...]) -> None:
        """Reads one instruction. Errors: ShaderError, IndexError, KeyError, struct.error."""
        if code in WITHOUT_EFFECT:
            return
        if code in ABOUT_THE_MODULE:
            self._note(ABOUT_THE_MODULE[code], operands)
        elif code in TYPES:
            self._types[operands[0]] = self._type(TYPES[code], operands[0], operands[1:])
        elif code in CONSTANTS:
            type_ = self._types[operands[0]]
            self._constants[operands[1]] = (type_, self._constant(CONSTANTS[code], type_, operands[2:]))
        elif code in OF_FUNCTIONS:
            self._structure(OF_FUNCTIONS[code], operands)
        elif code in WITH_RESULT:
            self._append(Instruction(WITH_RESULT[code], operands[2:], self._line, self._types[operands[0]], operands[1]))
        elif code in WITHOUT_RESULT or code in TERMINATORS:
            name = WITHOUT_RESULT.get(code) or TERMINATORS[code]
            self._append(Instruction(name, operands, self._line))
            if code in TERMINATORS:
                self._blocks.append(Block(self._label, tuple(self._body or ())))
                self._body = None
        else:
            raise ShaderError(f"{self.where()}: the SPIR-V instruction {code} is not known")

    def _append(self, instruction: Instruction) -> None:
        if self._body is None:
            raise IndexError(f"{instruction.name} stands outside a block")
        self._body.append(instruction)

    def _note(self, name: str, operands: tuple[int, ...]) -> None:
        """Reads an instruction that says something about the module."""
        match name:
            case "Line":
                self._line = operands[1]
            case "NoLine":
                self._line = 0
            case "Name":
                # The name of a function carries the types of its parameters, as in `f(vf3;f1;`.
                self._names[operands[0]] = _text(operands[1:]).partition("(")[0]
            case "MemberName":
                self._member_names.setdefault(operands[0], {})[operands[1]] = _text(operands[2:])
            case "ExtInstImport":
                library = _text(operands[1:])
                if library != "GLSL.std.450":
                    raise ShaderError(f"{self.where()}: the instruction set {library!r} is not known")
                self._library = operands[0]
            case "EntryPoint":
                if self._entry is not None or operands[0] not in STAGES:
                    raise ShaderError("only modules with one entry point, of a vertex or a fragment stage, can be run")
                self._entry = STAGES[operands[0]], operands[1]

    def _type(self, name: str, id_: int, operands: tuple[int, ...]) -> Type:
        """Returns the type that an instruction declares."""
        match name:
            case "void" | "bool" | "function":
                return Type(name)
            case "int" | "float":
                if operands[0] != WIDTH:
                    raise ShaderError(f"{self.where()}: numbers of {operands[0]} bits cannot be run; GLSL 3.30 has 32 bits")
                return Type(name, signed=name == "int" and operands[1] == 1)
            case "vector" | "matrix":
                if not 2 <= operands[1] <= 4:
                    raise IndexError(f"a {name} has {operands[1]} parts")
                return Type(name, element=self._types[operands[0]], count=operands[1])
            case "array":
                count = self._constants[operands[1]][1]
                if not isinstance(count, int) or not 1 <= count <= MOST_ELEMENTS:
                    raise ShaderError(f"{self.where()}: an array has {count} elements; {MOST_ELEMENTS:,} are allowed")
                return Type(name, element=self._types[operands[0]], count=count)
            case "struct":
                names = self._member_names.get(id_, {})
                members = tuple(self._types[member] for member in operands)
                named = tuple(names.get(index, "") for index in range(len(members)))
                return Type(name, members=members, names=named, name=self._names.get(id_, ""))
            case "pointer":
                if operands[0] not in STORAGES:
                    raise ShaderError(f"{self.where()}: variables of the storage class {operands[0]} cannot be run")
                return Type(name, element=self._types[operands[1]])
            case "image":
                return Type(name, element=self._types[operands[0]], count=operands[1])
            case "sampled image":
                return Type(name, element=self._types[operands[0]])
        raise KeyError(f"the type {name} is not known")

    def _constant(self, name: str, type_: Type, operands: tuple[int, ...]) -> Any:
        """Returns the value of a constant: a number, a tuple of values, or None for zero."""
        match name:
            case "true" | "false":
                return name == "true"
            case "number":
                layout = "<f" if type_.kind == "float" else "<i" if type_.signed else "<I"
                return struct.unpack(layout, struct.pack("<I", operands[0]))[0]
            case "composite":
                return tuple(self._constants[word][1] for word in operands)
        # Zero; an undefined value may have any value, so it may be zero too.
        return None

    def _structure(self, name: str, operands: tuple[int, ...]) -> None:
        """Reads an instruction that starts or ends a function or a block, or that declares a variable."""
        match name:
            case "Function":
                self._head, self._parameters, self._blocks = (operands[1], self._types[operands[0]]), [], []
            case "FunctionParameter":
                self._parameters.append((operands[1], self._types[operands[0]]))
            case "Label":
                if self._head is None or self._body is not None:
                    raise IndexError("a block starts outside a function, or within another block")
                self._label, self._body = operands[0], []
            case "FunctionEnd":
                if self._head is None or self._body is not None or not self._blocks:
                    raise IndexError("a function ends within a block, or before it starts")
                id_, type_ = self._head
                parameters = tuple(parameter for parameter, _ in self._parameters)
                types = tuple(type_of for _, type_of in self._parameters)
                name, blocks = self._names.get(id_, ""), tuple(self._blocks)
                self._functions[id_] = Function(id_, name, type_, parameters, types, blocks)
                self._head = None
            case "Variable":
                self._declare(operands)

    def _declare(self, operands: tuple[int, ...]) -> None:
        """Reads a variable: within a function it becomes an instruction, otherwise it is global."""
        type_ = self._types[operands[0]].element
        if type_ is None:
            raise IndexError("the type of a variable is no pointer")
        id_, initial = operands[1], operands[3] if len(operands) > 3 else 0
        if self._body is not None:
            self._append(Instruction("Variable", operands[3:], self._line, type_, id_))
            return
        name = self._names.get(id_) or type_.name
        self._variables.append(Variable(id_, name, STORAGES[operands[2]], type_, initial))

    def module(self) -> Module:
        """Returns the module. Errors: ShaderError where it has no entry point."""
        if self._entry is None or self._entry[1] not in self._functions or self._head is not None:
            raise ShaderError("the SPIR-V module is damaged: it has no entry point")
        stage, entry = self._entry
        return Module(stage, entry, self._functions, tuple(self._variables), self._constants, self._library, self._names)
