"""Operations: the instructions whose operands are all values, by name (SPIR-V Specification 1.6, sections 3.49.11 to 3.49.15).

An operation takes the arithmetic, the line that it stands in, and its operands. Vectors work component by component, because
components come before lanes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.spirv.arithmetic import NEAREST, Arithmetic
from glshade.spirv.values import stacked

Array = NDArray[Any]
Operation = Callable[..., Array]

# The largest error of a division (GLSL 4.60, section 4.7.1) [ulps].
DIVISION = 2.5
# The range of 32-bit integers.
INT, UINT = np.iinfo(np.int32), np.iinfo(np.uint32)


def total(arithmetic: Arithmetic, line: int, terms: Array) -> Array:
    """Returns the sum of terms along their first axis, rounded after each addition."""
    result: Array = terms[0]
    for term in terms[1:]:
        result = arithmetic.rounded(result + term, line)
    return result


def dot(arithmetic: Arithmetic, line: int, a: Array, b: Array) -> Array:
    """Returns the sum along the first axis of the products of a and b."""
    return total(arithmetic, line, arithmetic.rounded(a * b, line))


def rounded(function: Callable[..., Array], ulps: float = NEAREST) -> Operation:
    """Returns an operation on floats whose result is rounded. ulps: its largest error; by default, it is rounded to nearest."""
    return lambda arithmetic, line, *operands: arithmetic.rounded(function(*operands), line, ulps)


def exact(function: Callable[..., Array]) -> Operation:
    """Returns an operation that has no rounding error."""
    return lambda arithmetic, line, *operands: function(*operands)


def _matrix_times_vector(arithmetic: Arithmetic, line: int, matrix: Array, vector: Array) -> Array:
    # (columns, rows, n) times (columns, 1, n).
    return dot(arithmetic, line, matrix, vector[:, None])


def _vector_times_matrix(arithmetic: Arithmetic, line: int, vector: Array, matrix: Array) -> Array:
    # The sum runs over the rows, which must become the first axis.
    return dot(arithmetic, line, np.swapaxes(matrix, 0, 1), vector[:, None])


def _matrix_times_matrix(arithmetic: Arithmetic, line: int, a: Array, b: Array) -> Array:
    return stacked([_matrix_times_vector(arithmetic, line, a, column) for column in b])


def _to_int(values: Array) -> Array:
    """Returns floats as signed integers, rounded towards zero. Values out of range become the nearest integer, and NaN 0."""
    result: Array = np.clip(np.nan_to_num(np.trunc(values.astype(np.float64))), INT.min, INT.max).astype(np.int32)
    return result


def _to_uint(values: Array) -> Array:
    """Returns floats as unsigned integers, as `_to_int` does."""
    result: Array = np.clip(np.nan_to_num(np.trunc(values.astype(np.float64))), 0, UINT.max).astype(np.uint32)
    return result


def _divided(a: Array, b: Array) -> Array:
    """Returns the quotient of integers, rounded towards zero; dividing by zero gives zero, as the result is undefined."""
    divisor = np.where(b == 0, 1, b).astype(np.int64)
    wide = a.astype(np.int64)
    quotient = np.sign(wide) * np.sign(divisor) * (np.abs(wide) // np.abs(divisor))
    return np.where(b == 0, 0, quotient).astype(a.dtype)


def _remainder(a: Array, b: Array) -> Array:
    """Returns the remainder of integers, with the sign of a."""
    result: Array = a - _divided(a, b) * b
    return result


def _modulus(a: Array, b: Array) -> Array:
    """Returns the remainder of integers, with the sign of b."""
    rest = _remainder(a, b)
    return np.where((rest != 0) & ((rest < 0) != (b < 0)), rest + b, rest).astype(a.dtype)


def _signed(function: Callable[..., Array], dtype: type[Any]) -> Operation:
    """Returns an operation on integers that takes its operands as signed (int32) or unsigned (uint32)."""
    return exact(lambda *operands: function(*(operand.view(dtype) for operand in operands)))


def _shifted(function: Callable[..., Array], dtype: type[Any]) -> Operation:
    """Returns a shift. A shift by 32 bits or more is undefined, so the amount is taken modulo 32."""
    return exact(lambda a, b: function(a.view(dtype), (b.view(np.uint32) & np.uint32(31)).astype(dtype)).view(a.dtype))


_INTEGERS: dict[str, Operation] = {
    "SNegate": exact(np.negative),
    "IAdd": exact(np.add),
    "ISub": exact(np.subtract),
    "IMul": exact(np.multiply),
    "UDiv": _signed(_divided, np.uint32),
    "SDiv": _signed(_divided, np.int32),
    "UMod": _signed(_remainder, np.uint32),
    "SMod": _signed(_modulus, np.int32),
    "BitwiseOr": exact(np.bitwise_or),
    "BitwiseXor": exact(np.bitwise_xor),
    "BitwiseAnd": exact(np.bitwise_and),
    "Not": exact(np.bitwise_not),
    "ShiftRightLogical": _shifted(np.right_shift, np.uint32),
    "ShiftRightArithmetic": _shifted(np.right_shift, np.int32),
    "ShiftLeftLogical": _shifted(np.left_shift, np.uint32),
}
_COMPARISONS: Mapping[str, Callable[..., Any]] = {
    "Equal": np.equal,
    "NotEqual": np.not_equal,
    "LessThan": np.less,
    "GreaterThan": np.greater,
    "LessThanEqual": np.less_equal,
    "GreaterThanEqual": np.greater_equal,
}
_LOGIC: dict[str, Operation] = {
    "LogicalEqual": exact(np.equal),
    "LogicalNotEqual": exact(np.not_equal),
    "LogicalOr": exact(np.logical_or),
    "LogicalAnd": exact(np.logical_and),
    "LogicalNot": exact(np.logical_not),
    "Any": exact(lambda a: a.any(axis=0)),
    "All": exact(lambda a: a.all(axis=0)),
    "IsNan": exact(np.isnan),
    "IsInf": exact(np.isinf),
}
_FLOATS: dict[str, Operation] = {
    "FNegate": exact(np.negative),
    "FAdd": rounded(np.add),
    "FSub": rounded(np.subtract),
    "FMul": rounded(np.multiply),
    "FDiv": rounded(np.divide, DIVISION),
    "FMod": rounded(lambda a, b: a - b * np.floor(a / b), DIVISION),
    "VectorTimesScalar": rounded(np.multiply),
    "MatrixTimesScalar": rounded(np.multiply),
    "MatrixTimesVector": _matrix_times_vector,
    "VectorTimesMatrix": _vector_times_matrix,
    "MatrixTimesMatrix": _matrix_times_matrix,
    "OuterProduct": lambda arithmetic, line, a, b: arithmetic.rounded(a[None] * b[:, None], line),
    "Dot": dot,
    "Transpose": exact(lambda a: np.swapaxes(a, 0, 1)),
    "ConvertFToS": exact(_to_int),
    "ConvertFToU": exact(_to_uint),
    # float32 does not hold all integers above 2^24, so the result is rounded.
    "ConvertSToF": lambda arithmetic, line, a: a.astype(np.float32).astype(arithmetic.dtype),
    "ConvertUToF": lambda arithmetic, line, a: a.astype(np.float32).astype(arithmetic.dtype),
    # The condition may be a scalar for vectors too; lanes are the last axis either way.
    "Select": exact(np.where),
}
OPERATIONS: dict[str, Operation] = {
    **_INTEGERS,
    **_LOGIC,
    **_FLOATS,
    **{f"FOrd{name}": exact(function) for name, function in _COMPARISONS.items() if name != "NotEqual"},
    # "Ordered and not equal" is False where an operand is NaN, unlike NumPy's comparison.
    "FOrdNotEqual": exact(lambda a, b: (a < b) | (a > b)),
    "FUnordNotEqual": exact(np.not_equal),
    **{f"S{name}": _signed(function, np.int32) for name, function in _COMPARISONS.items() if "Than" in name},
    **{f"U{name}": _signed(function, np.uint32) for name, function in _COMPARISONS.items() if "Than" in name},
    "IEqual": exact(np.equal),
    "INotEqual": exact(np.not_equal),
}
