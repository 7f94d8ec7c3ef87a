"""Trace: the value of every variable, line by line, as a stage computes it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.glsl.source import Stage
from glshade.spirv.machine import Observer
from glshade.spirv.module import Function, Instruction, Module, Type
from glshade.spirv.values import Mask, Value, left

Array = NDArray[Any]

# The compiler copies arguments into variables of this name before a call. They have the values of the arguments.
ARGUMENT = "param"


@dataclass(frozen=True)
class Step:
    """A value that a line gives to a variable, or that a function returns.

    line: the number of the line in the stage's text, counted from 1.
    place: the file and the line in it, as `file:line`.
    text: the line.
    function: the name of the function that the line stands in.
    name: the variable with the path to the member that changes, such as `m.kd`, or `return`.
    type: its type in GLSL.
    value: the values (N, ...), in the layout of NumPy; of lanes that do not run the line, they mean nothing.
    running: (N,), True for the lanes that run the line.
    """

    line: int
    place: str
    text: str
    function: str
    name: str
    type: str
    value: Any
    running: NDArray[np.bool_]

    @property
    def has_picture(self) -> bool:
        """Whether its values are numbers or vectors, which can be shown as a picture."""
        return not isinstance(self.value, tuple) and np.ndim(self.value) <= 2


class Recorder:
    """Records the steps of a run: its `observe` is given to the machine.

    steps: the steps so far, in the order in which they ran.
    """

    def __init__(self, module: Module, stage: Stage, lanes: int) -> None:
        self.steps: list[Step] = []
        self._stage, self._text, self._lanes = stage, stage.text.splitlines(), lanes
        self._targets = {
            id(step): (function.name, *target)
            for function in module.functions.values()
            for step, target in _targets(module, function)
        }

    @property
    def observe(self) -> Observer:
        """The observer of the run."""
        return self._observe

    def _observe(self, instruction: Instruction, value: Value, mask: Mask) -> None:
        if id(instruction) not in self._targets:
            return
        function, name, type_ = self._targets[id(instruction)]
        text = self._text[instruction.line - 1].strip() if 0 < instruction.line <= len(self._text) else ""
        running = np.ones(self._lanes, np.bool_) if mask is None else np.broadcast_to(mask, self._lanes)
        place = self._stage.place(instruction.line) if instruction.line else ""
        value = left(value, self._lanes)
        self.steps.append(Step(instruction.line, place, text, function, name, str(type_), value, running))


def _targets(module: Module, function: Function) -> Iterator[tuple[Instruction, tuple[str, Type]]]:
    """Yields the instructions that give a variable a value or return one, each with the variable's name and its type."""
    names: dict[int, tuple[str, Type]] = {v.id: (v.name, v.type) for v in module.variables}
    for id_, pointer in zip(function.parameters, function.types, strict=True):
        names[id_] = (module.names.get(id_, ""), pointer.element or pointer)
    for step in function.instructions:
        if step.name == "Variable" and step.type is not None:
            names[step.result] = (module.names.get(step.result, ""), step.type)
        elif step.name == "AccessChain" and step.type is not None and step.type.element is not None:
            base, path = step.operands[0], step.operands[1:]
            if base in names:
                names[step.result] = (_member(module, *names[base], path), step.type.element)
        elif step.name == "Store" and step.operands[0] in names:
            name, type_ = names[step.operands[0]]
            if name and not name.startswith(ARGUMENT):
                yield step, (name, type_)
        elif step.name == "ReturnValue":
            yield step, ("return", function.type)


def _member(module: Module, name: str, type_: Type, path: tuple[int, ...]) -> str:
    """Returns the name of a part of a variable, such as `m.kd`, `lights[2].position` or `n.x`.

    An index that is no constant is written as i.
    """
    for id_ in path:
        index = module.constants[id_][1] if id_ in module.constants else None
        if type_.kind == "struct" and isinstance(index, int):
            name, type_ = f"{name}.{type_.names[index]}", type_.members[index]
        else:
            letter = type_.kind == "vector" and isinstance(index, int)
            name += f".{'xyzw'[index]}" if letter and index is not None else f"[{'i' if index is None else index}]"
            type_ = type_.element or type_
    return name


def short(value: Any, digits: int = 7) -> str:
    """Returns a value as a short text: numbers with a number of digits, vectors in parentheses, and - for None.

    An array that holds one lane is written as that lane's value.
    """
    if value is None:
        return "-"
    if isinstance(value, tuple) or np.ndim(value):
        return short(value[0], digits) if len(value) == 1 else f"({', '.join(short(part, digits) for part in value)})"
    return str(bool(value)).lower() if isinstance(value, bool | np.bool_) else f"{value:.{digits}g}"
