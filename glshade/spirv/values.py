"""Values: what the machine computes with. The last axis of every array counts lanes, one for each vertex or pixel.

A scalar is an array (n,), a vector of C components (C, n), and a matrix (columns, rows, n), where n is the number of lanes, or
1 for a value that is the same in all lanes. Arrays and structs are tuples of values. Values never change: a store makes a new
one.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from glshade.errors import ShaderError
from glshade.spirv.module import Type

Array = NDArray[Any]
Value: TypeAlias = "Array | tuple[Any, ...]"
# True for the lanes that run; None for all of them.
Mask: TypeAlias = "NDArray[np.bool_] | None"
# An index: the same in all lanes, or (n,).
Index: TypeAlias = "int | Array"


_BOOLS, _INTS, _UINTS = np.dtype(np.bool_), np.dtype(np.int32), np.dtype(np.uint32)


def dtype_of(type_: Type, floats: np.dtype[Any]) -> np.dtype[Any]:
    """Returns the NumPy type of the numbers of a scalar, vector or matrix. floats: the type of floats."""
    scalar = type_.scalar
    if scalar.kind == "float":
        return floats
    if scalar.kind == "bool":
        return _BOOLS
    return _INTS if scalar.signed else _UINTS


def constant(type_: Type, value: Any, floats: np.dtype[Any]) -> Value:
    """Returns a constant of a module as a value. value: as in Module.constants."""
    if type_.kind in ("array", "struct"):
        types = type_.members if type_.kind == "struct" else (type_.element,) * type_.count
        parts = (None,) * len(types) if value is None else value
        return tuple(constant(member, part, floats) for member, part in zip(types, parts, strict=True) if member)
    dtype = dtype_of(type_, floats)
    return np.zeros((*shape(type_), 1), dtype) if value is None else np.asarray(value, dtype)[..., None]


def shape(type_: Type) -> tuple[int, ...]:
    """Returns the shape of a scalar, vector or matrix without the axis of lanes."""
    if type_.kind == "matrix" and type_.element:
        return (type_.count, type_.element.count)
    return (type_.count,) if type_.kind == "vector" else ()


def select(mask: Array, new: Value, old: Value) -> Value:
    """Returns `new` in the lanes where the mask is True, and `old` elsewhere."""
    if isinstance(new, tuple):
        return tuple(select(mask, a, b) for a, b in zip(new, old, strict=True))
    return np.where(mask, new, old)


def merged(mask: Mask, new: Value, old: Value) -> Value:
    """Returns `new` in the lanes that run, and `old` elsewhere."""
    return new if mask is None else select(mask, new, old)


def uniform(index: Array) -> Index:
    """Returns an index (n,) as a number if it is the same in all lanes."""
    first = index.reshape(-1)[0]
    return int(first) if index.size == 1 or bool((index == first).all()) else index


def part(value: Value, path: Sequence[Index]) -> Value:
    """Returns the part of a value that a path of indices leads to. An index beyond the end leads to the last part."""
    if not path:
        return value
    head, rest = path[0], path[1:]
    last = len(value) - 1
    if isinstance(head, int):
        return part(value[min(max(head, 0), last)], rest)
    found = part(value[0], rest)
    for index in range(1, len(value)):
        found = select(head == index if index < last else head >= index, part(value[index], rest), found)
    return found


def with_part(value: Value, path: Sequence[Index], new: Value, mask: Mask) -> Value:
    """Returns a value in which the part that a path leads to is replaced, in the lanes that run."""
    if not path:
        return merged(mask, new, value)
    head, rest = path[0], path[1:]
    last = len(value) - 1
    if isinstance(head, int):
        chosen = min(max(head, 0), last)
        return _replaced(value, {chosen: with_part(value[chosen], rest, new, mask)})
    running = np.True_ if mask is None else mask
    changed = {
        index: with_part(value[index], rest, new, running & (head == index if index < last else head >= index))
        for index in range(len(value))
    }
    return _replaced(value, changed)


def _replaced(value: Value, parts: dict[int, Value]) -> Value:
    """Returns a value with other parts at some places of its first axis."""
    if isinstance(value, tuple):
        return tuple(parts.get(index, old) for index, old in enumerate(value))
    lanes = max(value.shape[-1], *(np.shape(new)[-1] for new in parts.values()))
    result = np.array(np.broadcast_to(value, (*value.shape[:-1], lanes)))
    for index, new in parts.items():
        result[index] = new
    return result


def stacked(parts: Sequence[Array]) -> Array:
    """Returns scalars or vectors as one array, along a new first axis."""
    return np.stack(np.broadcast_arrays(*parts))


def entered(type_: Type, given: Any, lanes: int, name: str, floats: np.dtype[Any]) -> Value:
    """Returns an input that was given in the layout of NumPy as a value.

    given: for a scalar, vector or matrix (rows, columns) an array with the axis of lanes first, (n, ...), or without it if it
        is the same in all lanes; for an array a sequence of such arrays; for a struct a mapping from member to them.
    Errors: ShaderError where the shape does not fit.
    """
    if type_.kind == "struct":
        try:
            parts = [given[member] for member in type_.names]
        except (KeyError, TypeError):
            raise ShaderError(f"{name}: give a mapping with {', '.join(type_.names)}") from None
        return tuple(
            entered(member, value, lanes, f"{name}.{label}", floats)
            for member, value, label in zip(type_.members, parts, type_.names, strict=True)
        )
    if type_.kind == "array" and type_.element:
        if len(given) != type_.count:
            raise ShaderError(f"{name}: has {len(given)} elements, not {type_.count}")
        return tuple(entered(type_.element, value, lanes, f"{name}[{i}]", floats) for i, value in enumerate(given))
    array = np.asarray(given, dtype_of(type_, floats))
    if type_.kind == "matrix" and array.ndim > 1:
        array = np.swapaxes(array, -1, -2)
    wanted = shape(type_)
    if array.shape == wanted:
        return array[..., None]
    if array.shape == (lanes, *wanted):
        return np.moveaxis(array, 0, -1)
    raise ShaderError(f"{name}: has the shape {array.shape}; {wanted} or {(lanes, *wanted)} fits the type {type_}")


def left(value: Value, lanes: int) -> Any:
    """Returns a value in the layout of NumPy: arrays with the axis of lanes first, and tuples of them."""
    if isinstance(value, tuple):
        return tuple(left(member, lanes) for member in value)
    array = np.moveaxis(np.broadcast_to(value, (*value.shape[:-1], lanes)), -1, 0)
    return np.swapaxes(array, -1, -2) if array.ndim > 2 else array
