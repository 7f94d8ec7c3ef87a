"""Machine: runs a module over many lanes at once, one lane for each vertex or pixel.

Where lanes take different branches, each block runs for the lanes that reached it, and the others keep their values. The blocks
of structured control flow are in such an order that the first pending block is always the right one to run next: the header of
a loop stands before its body, and the block in which branches meet stands after them (SPIR-V Specification 1.6, section 2.11).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from glshade.errors import ShaderError
from glshade.spirv.arithmetic import FLOAT32, FLOAT64, Arithmetic
from glshade.spirv.library import FREXP, FUNCTIONS, MODF
from glshade.spirv.module import Function, Instruction, Module, Type, Variable
from glshade.spirv.operations import OPERATIONS
from glshade.spirv.reader import Place
from glshade.spirv.values import (
    Index,
    Mask,
    Value,
    constant,
    dtype_of,
    entered,
    left,
    merged,
    part,
    stacked,
    uniform,
    with_part,
)

Array = NDArray[Any]

# No run may execute more blocks than this. A loop over 256 lights, a page of them, executes some 10,000; a loop without end
# stops here after some seconds.
MOST_BLOCKS = 100_000
# No function may call others to a greater depth. GLSL has no recursion, and shipped shaders have a depth of 8.
MOST_CALLS = 64
# The bits of an image instruction's operands (section 3.14).
BIAS, LOD, GRAD, CONST_OFFSET = 1, 2, 4, 8
# The lanes of a square of pixels: left and right above, left and right below.
SQUARE = 4


class Texture(Protocol):
    """The picture that a sampler reads."""

    def sample(self, at: Array, level: Array | None, bias: Array, steps: tuple[Array, Array] | None) -> Array:
        """Returns the filtered texels (4, n).

        at: (2, n), texture coordinates; (3, n) for a texture of three dimensions.
        level: (n,), the level of detail; None to derive it.
        bias: (n,), which is added to a derived level.
        steps: the changes (2, n) of `at` from a pixel to the next one in x and in y; None where lanes are no squares of pixels.
        """

    def fetch(self, at: Array, level: Array) -> Array:
        """Returns the texels (4, n) at integer coordinates (2, n) of a level (n,)."""

    def size(self, level: Array) -> tuple[int, ...]:
        """Returns width and height of a level, and the depth of a texture of three dimensions [texels]."""


@dataclass(frozen=True, eq=False)
class Result:
    """The result of a run.

    outputs: name -> value of the stage's outputs, with the axis of lanes first. The members of gl_PerVertex, such as
        gl_Position, have entries of their own.
    discarded: (n,), True for the lanes that the stage discarded.
    """

    outputs: dict[str, Any]
    discarded: NDArray[np.bool_]


# Is called with each instruction that gives a value, stores or returns one, with that value and the lanes that run.
Observer = Callable[[Instruction, Value, Mask], None]


def run(
    module: Module,
    inputs: Mapping[str, Any],
    lanes: int,
    arithmetic: Arithmetic = FLOAT64,
    *,
    squares: bool = False,
    observer: Observer | None = None,
    place: Place = lambda line: f"line {line}",
) -> Result:
    """Runs a module.

    inputs: name -> value of the inputs and uniforms, in the layout that `values.entered` explains; a sampler's value is a
        Texture. Names that the module does not have are ignored.
    lanes: the number of lanes.
    squares: True if every four lanes are a square of pixels, so that derivatives can be computed.
    observer: optional; sees every value.
    place: turns a line of the text into the place that messages name.
    Errors: ShaderError for a missing input, for an operation that cannot be run, and for a loop that does not end.
    """
    machine = _Machine(module, lanes, arithmetic, squares, observer, place)
    # Undefined results, such as 0/0, are values like any others.
    with np.errstate(all="ignore"):
        return machine.run(inputs)


@dataclass(eq=False)
class _Cell:
    """A variable. value: its value."""

    value: Any


@dataclass(frozen=True, eq=False)
class _Pointer:
    """A pointer to a part of a variable.

    cell: the variable.
    path: the indices that lead to the part.
    """

    cell: _Cell
    path: tuple[Index, ...] = ()


@dataclass(eq=False)
class _Call:
    """A function that is running.

    values: id -> value or pointer, of the function's own results and of all global variables and constants.
    result: the value that it returns; None where no lane has returned yet.
    """

    values: dict[int, Any]
    result: Value | None = None


@dataclass(eq=False)
class _Machine:
    module: Module
    lanes: int
    arithmetic: Arithmetic
    squares: bool
    observer: Observer | None
    place: Place
    line: int = 0
    executed: int = 0
    depth: int = 0
    # The lanes that have not been discarded.
    alive: Mask = None
    globals: dict[int, Any] = field(default_factory=dict)

    def run(self, inputs: Mapping[str, Any]) -> Result:
        module = self.module
        floats = self.arithmetic.dtype
        for id_, (type_, value) in module.constants.items():
            self.globals[id_] = constant(type_, value, floats)
        for variable in module.variables:
            self.globals[variable.id] = _Pointer(_Cell(self._initial(variable, inputs)))
        try:
            self._call(module.functions[module.entry], [], None)
        except (KeyError, IndexError, AttributeError, TypeError, ValueError) as error:
            raise ShaderError(f"{self._where()}: the SPIR-V module cannot be run: {error}") from None
        outputs: dict[str, Any] = {}
        for variable in module.variables:
            if variable.storage != "out":
                continue
            value = self.globals[variable.id].cell.value
            if variable.type.kind == "struct":
                outputs |= {name: left(v, self.lanes) for name, v in zip(variable.type.names, value, strict=True)}
            else:
                outputs[variable.name] = left(value, self.lanes)
        alive = np.ones(self.lanes, np.bool_) if self.alive is None else np.broadcast_to(self.alive, self.lanes)
        return Result(outputs, ~alive)

    def _initial(self, variable: Variable, inputs: Mapping[str, Any]) -> Any:
        """Returns the value with which a global variable starts. Errors: ShaderError for a missing or ill-shaped input."""
        if variable.storage in ("in", "uniform", "block"):
            if variable.name in inputs:
                given = inputs[variable.name]
                if variable.type.kind == "sampled image":
                    return given
                return entered(variable.type, given, self.lanes, variable.name, self.arithmetic.dtype)
            if self._is_used(variable.id):
                raise ShaderError(f"{variable.name}: is an input of the {self.module.stage} stage, and no value is given")
        if variable.type.kind == "sampled image":
            return None
        if variable.initial:
            return self.globals[variable.initial]
        return constant(variable.type, None, self.arithmetic.dtype)

    def _is_used(self, id_: int) -> bool:
        """Returns whether an instruction names a variable."""
        return any(id_ in instruction.operands for f in self.module.functions.values() for instruction in f.instructions)

    def _where(self) -> str:
        return self.place(self.line) if self.line else f"{self.module.stage} stage"

    def _call(self, function: Function, arguments: list[Any], mask: Mask) -> Value | None:
        """Runs a function for some lanes and returns its result."""
        if self.depth >= MOST_CALLS:
            raise ShaderError(f"{self._where()}: calls are nested deeper than {MOST_CALLS}")
        self.depth += 1
        call = _Call({**self.globals, **dict(zip(function.parameters, arguments, strict=True))})
        places = {block.id: index for index, block in enumerate(function.blocks)}
        # Place of a block -> (block that led to it, lanes that came from there).
        pending: dict[int, list[tuple[int, Mask]]] = {0: [(0, mask)]}
        while pending:
            at = min(pending)
            arrivals = [(origin, self._living(lanes)) for origin, lanes in pending.pop(at)]
            running = _union([lanes for _, lanes in arrivals])
            if running is not None and not running.any():
                continue
            self.executed += 1
            if self.executed > MOST_BLOCKS:
                raise ShaderError(f"{self._where()}: the shader runs more than {MOST_BLOCKS:,} blocks; a loop may not end")
            block = function.blocks[at]
            for target, lanes in self._block(block.instructions, call, arrivals, running):
                pending.setdefault(places[target], []).append((block.id, lanes))
        self.depth -= 1
        if call.result is None and function.type.kind != "void":
            # All lanes were discarded within the function.
            return constant(function.type, None, self.arithmetic.dtype)
        return call.result

    def _living(self, mask: Mask) -> Mask:
        """Returns the lanes of a mask that have not been discarded."""
        if self.alive is None:
            return mask
        return self.alive if mask is None else mask & self.alive

    def _block(
        self, instructions: tuple[Instruction, ...], call: _Call, arrivals: list[tuple[int, Mask]], mask: Mask
    ) -> list[tuple[int, Mask]]:
        """Runs a block and returns the blocks that follow, each with the lanes that go there."""
        values, alive = call.values, self.alive
        phis = {step.result: self._phi(step, call, arrivals) for step in instructions if step.name == "Phi"}
        # Phis of a block take the values from before the block, so they change together.
        values.update(phis)
        for step in instructions[:-1]:
            name, operands, line, type_, result = step
            self.line = line or self.line
            if self.alive is not alive:
                alive, mask = self.alive, self._living(mask)
            if name in OPERATIONS:
                value = OPERATIONS[name](self.arithmetic, self.line, *[values[id_] for id_ in operands])
                value = self._typed(type_, value)
            elif name in _METHODS:
                value = _METHODS[name](self, step, call, mask)
            elif name == "Phi":
                continue
            else:
                raise ShaderError(f"{self._where()}: the SPIR-V instruction {name} cannot be run")
            if result:
                self._keep(call, step, value, mask)
        last = instructions[-1]
        self.line = last.line or self.line
        return self._follow(last, call, self._living(mask))

    def _keep(self, call: _Call, instruction: Instruction, value: Any, mask: Mask) -> None:
        """Keeps the result of an instruction. In a loop, lanes that have left it keep their value of the last round."""
        if self.observer is not None and isinstance(value, (np.ndarray, tuple)):
            self.observer(instruction, value, mask)
        if mask is not None and isinstance(value, np.ndarray):
            old = call.values.get(instruction.result)
            if isinstance(old, np.ndarray):
                value = np.where(mask, value, old)
        call.values[instruction.result] = value

    def _phi(self, instruction: Instruction, call: _Call, arrivals: list[tuple[int, Mask]]) -> Value:
        """Returns, in each lane, the value that belongs to the block that the lane came from."""
        value_of = dict(zip(instruction.operands[1::2], instruction.operands[::2], strict=True))
        result: Value | None = None
        for origin, mask in arrivals:
            value = call.values[value_of[origin]]
            result = value if result is None else merged(mask, value, result)
        if result is None:
            raise KeyError("a block has no origin")
        return result

    def _follow(self, last: Instruction, call: _Call, mask: Mask) -> list[tuple[int, Mask]]:
        """Returns the blocks that follow a block's last instruction, each with the lanes that go there."""
        operands = last.operands
        match last.name:
            case "Branch":
                return [(operands[0], mask)]
            case "BranchConditional":
                return _split(call.values[operands[0]], operands[1], operands[2], mask)
            case "Switch":
                return self._switch(last, call, mask)
            case "ReturnValue":
                value = call.values[operands[0]]
                if self.observer is not None:
                    self.observer(last, value, mask)
                call.result = value if call.result is None else merged(mask, value, call.result)
            case "Kill":
                ended = np.ones(self.lanes, np.bool_) if mask is None else np.broadcast_to(mask, self.lanes)
                self.alive = ~ended if self.alive is None else self.alive & ~ended
        return []

    def _switch(self, last: Instruction, call: _Call, mask: Mask) -> list[tuple[int, Mask]]:
        """Returns the blocks that follow a switch."""
        selector = call.values[last.operands[0]]
        rest: Array = np.ones(selector.shape, np.bool_)
        targets: list[tuple[int, Mask]] = []
        for literal, target in zip(last.operands[2::2], last.operands[3::2], strict=True):
            chosen = selector.view(np.uint32) == np.uint32(literal)
            targets += [(t, m) for t, m in _split(chosen, target, 0, mask) if t]
            rest &= ~chosen
        return targets + [(t, m) for t, m in _split(rest, last.operands[1], 0, mask) if t]

    def _typed(self, type_: Type | None, value: Any) -> Any:
        """Returns a result with the type of numbers that its instruction declares."""
        if type_ is None or isinstance(value, tuple):
            return value
        wanted = dtype_of(type_, self.arithmetic.dtype)
        return value if value.dtype is wanted else value.astype(wanted, copy=False)

    # Each method below runs the instruction of its name. Its operands are ids, unless it says otherwise.

    def _op_Variable(self, instruction: Instruction, call: _Call, mask: Mask) -> _Pointer:
        assert instruction.type is not None
        initial = call.values[instruction.operands[0]] if instruction.operands else None
        return _Pointer(_Cell(constant(instruction.type, None, self.arithmetic.dtype) if initial is None else initial))

    def _op_Load(self, instruction: Instruction, call: _Call, mask: Mask) -> Any:
        pointer = call.values[instruction.operands[0]]
        return part(pointer.cell.value, pointer.path)

    def _op_Store(self, instruction: Instruction, call: _Call, mask: Mask) -> None:
        pointer, value = (call.values[id_] for id_ in instruction.operands[:2])
        self._store(pointer, value, mask)
        if self.observer is not None:
            self.observer(instruction, value, mask)

    def _store(self, pointer: _Pointer, value: Value, mask: Mask) -> None:
        pointer.cell.value = with_part(pointer.cell.value, pointer.path, value, mask)

    def _op_AccessChain(self, instruction: Instruction, call: _Call, mask: Mask) -> _Pointer:
        pointer, *indices = (call.values[id_] for id_ in instruction.operands)
        return _Pointer(pointer.cell, (*pointer.path, *(uniform(index) for index in indices)))

    def _op_FunctionCall(self, instruction: Instruction, call: _Call, mask: Mask) -> Any:
        arguments = [call.values[id_] for id_ in instruction.operands[1:]]
        return self._call(self.module.functions[instruction.operands[0]], arguments, mask)

    def _op_CompositeConstruct(self, instruction: Instruction, call: _Call, mask: Mask) -> Value:
        parts = [call.values[id_] for id_ in instruction.operands]
        type_ = instruction.type
        if type_ is None or type_.kind in ("struct", "array"):
            return tuple(parts)
        if type_.kind == "vector":
            # A vector may be made from scalars and from shorter vectors.
            parts = [component for item in parts for component in (item if item.ndim > 1 else [item])]
        return stacked(parts)

    def _op_CompositeExtract(self, instruction: Instruction, call: _Call, mask: Mask) -> Any:
        # The path is given by numbers, not by ids.
        return part(call.values[instruction.operands[0]], instruction.operands[1:])

    def _op_VectorShuffle(self, instruction: Instruction, call: _Call, mask: Mask) -> Any:
        first, second = (call.values[id_] for id_ in instruction.operands[:2])
        components = [*first, *second]
        # The number 0xFFFFFFFF stands for a component that is not used.
        return stacked([components[min(number, len(components) - 1)] for number in instruction.operands[2:]])

    def _op_VectorExtractDynamic(self, instruction: Instruction, call: _Call, mask: Mask) -> Any:
        vector, index = (call.values[id_] for id_ in instruction.operands)
        return part(vector, (uniform(index),))

    def _op_Bitcast(self, instruction: Instruction, call: _Call, mask: Mask) -> Any:
        value = call.values[instruction.operands[0]]
        assert instruction.type is not None
        # The bits are those of 32-bit numbers in every arithmetic.
        source = value.astype(np.float32) if value.dtype.kind == "f" else value
        bits = source.view(dtype_of(instruction.type, FLOAT32.dtype))
        return self._typed(instruction.type, bits)

    def _op_ExtInst(self, instruction: Instruction, call: _Call, mask: Mask) -> Any:
        library, number, *ids = instruction.operands
        if library != self.module.library:
            raise KeyError(f"the instruction set {library} is not known")
        operands = [call.values[id_] for id_ in ids]
        if number == FREXP:
            significand, exponent = np.frexp(operands[0])
            return significand, exponent.astype(np.int32)
        if number == MODF:
            fraction, whole = np.modf(operands[0])
            self._store(operands[1], whole, mask)
            return fraction
        if number not in FUNCTIONS:
            raise ShaderError(f"{self._where()}: the built-in function {number} of GLSL.std.450 cannot be run")
        return self._typed(instruction.type, FUNCTIONS[number](self.arithmetic, self.line, *operands))

    def _op_DPdx(self, instruction: Instruction, call: _Call, mask: Mask) -> Any:
        return self._typed(instruction.type, self._derivative(call.values[instruction.operands[0]], 0))

    def _op_DPdy(self, instruction: Instruction, call: _Call, mask: Mask) -> Any:
        return self._typed(instruction.type, self._derivative(call.values[instruction.operands[0]], 1))

    def _op_Fwidth(self, instruction: Instruction, call: _Call, mask: Mask) -> Any:
        value = call.values[instruction.operands[0]]
        return self._typed(instruction.type, np.abs(self._derivative(value, 0)) + np.abs(self._derivative(value, 1)))

    def _derivative(self, value: Array, axis: int) -> Array:
        """Returns the change of a value from a pixel to the next one in x (axis 0) or in y (axis 1).

        Errors: ShaderError where lanes are no squares of pixels.
        """
        if not self.squares or self.lanes % SQUARE:
            raise ShaderError(f"{self._where()}: derivatives need squares of pixels")
        # (..., squares, row, column)
        square = np.broadcast_to(value, (*value.shape[:-1], self.lanes)).reshape(*value.shape[:-1], -1, 2, 2)
        steps = np.diff(square, axis=-1 if axis == 0 else -2)
        return np.broadcast_to(steps, square.shape).reshape(*value.shape[:-1], self.lanes)

    def _op_Image(self, instruction: Instruction, call: _Call, mask: Mask) -> Any:
        return call.values[instruction.operands[0]]

    def _op_ImageSampleImplicitLod(self, instruction: Instruction, call: _Call, mask: Mask) -> Any:
        return self._sampled(instruction, call, call.values[instruction.operands[1]])

    def _op_ImageSampleProjImplicitLod(self, instruction: Instruction, call: _Call, mask: Mask) -> Any:
        at = call.values[instruction.operands[1]]
        return self._sampled(instruction, call, at[:-1] / at[-1])

    _op_ImageSampleExplicitLod = _op_ImageSampleImplicitLod
    _op_ImageSampleProjExplicitLod = _op_ImageSampleProjImplicitLod

    def _sampled(self, instruction: Instruction, call: _Call, at: Array) -> Any:
        """Returns the filtered texels (4, n) of an image instruction at texture coordinates."""
        texture = call.values[instruction.operands[0]]
        options = iter(instruction.operands[2:])
        kind = next(options, 0)
        if kind & ~(BIAS | LOD | GRAD):
            raise ShaderError(f"{self._where()}: offsets of texture coordinates cannot be run")
        bias = call.values[next(options)] if kind & BIAS else np.zeros(1)
        level = call.values[next(options)] if kind & LOD else None
        steps = (call.values[next(options)], call.values[next(options)]) if kind & GRAD else None
        if level is None and steps is None:
            if self.module.stage == "vertex":
                # A stage without derivatives reads the base level (GLSL 4.60, section 8.9).
                level = np.zeros(1)
            elif self.squares:
                steps = self._derivative(at, 0), self._derivative(at, 1)
        return self._typed(instruction.type, texture.sample(at, level, bias, steps))

    def _op_ImageFetch(self, instruction: Instruction, call: _Call, mask: Mask) -> Any:
        texture, at = (call.values[id_] for id_ in instruction.operands[:2])
        kind, *rest = instruction.operands[2:] or (0,)
        if kind & ~LOD:
            raise ShaderError(f"{self._where()}: offsets of texel coordinates cannot be run")
        level = call.values[rest[0]] if kind & LOD else np.zeros(1, np.int32)
        return self._typed(instruction.type, texture.fetch(at, level))

    def _op_ImageQuerySizeLod(self, instruction: Instruction, call: _Call, mask: Mask) -> Any:
        texture, level = (call.values[id_] for id_ in instruction.operands)
        return self._typed(instruction.type, np.array(texture.size(level))[:, None])


# Name of an instruction -> the method that runs it, for all that are no plain operations on values.
_METHODS: dict[str, Callable[..., Any]] = {
    name.removeprefix("_op_"): method for name, method in vars(_Machine).items() if name.startswith("_op_")
}


def _union(masks: list[Mask]) -> Mask:
    """Returns the lanes that are in any of the masks."""
    result: Mask = None
    for mask in masks:
        if mask is None:
            return None
        result = mask if result is None else result | mask
    return result


def _split(condition: Array, yes: int, no: int, mask: Mask) -> list[tuple[int, Mask]]:
    """Returns the two blocks of a branch, each with the lanes that go there; a block to which no lane goes is left out."""
    if condition.size == 1:
        return [(yes if bool(condition.reshape(-1)[0]) else no, mask)]
    chosen = condition if mask is None else condition & mask
    others = ~condition if mask is None else ~condition & mask
    if not chosen.any():
        return [(no, mask)]
    if not others.any():
        return [(yes, mask)]
    return [(yes, chosen), (no, others)]
