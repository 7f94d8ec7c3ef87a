"""Library: the built-in functions of GLSL, by their numbers in the instruction set GLSL.std.450.

Each has the error that GLSL allows it (GLSL 4.60, section 4.7.1). GLSL leaves the errors of trigonometry open. For sin and cos,
Vulkan allows 2^-11, and drivers do much better, so they count with a few ulps. The inverse functions count with the 4096 ulps
that Vulkan allows (Vulkan 1.3, appendix A, "Precision and Operation of SPIR-V Instructions"): Mesa's polynomials use much of
that.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.spirv.arithmetic import NEAREST, ULP, Arithmetic
from glshade.spirv.operations import DIVISION, Operation, dot, exact, rounded

Array = NDArray[Any]

# The largest errors of 1/sqrt(x), and of sqrt(x), which may be computed as 1/(1/sqrt(x)) [ulps].
INVERSE_SQRT, SQRT = 2.0, 4.5
# The largest error of log2, outside [0.5, 2] [ulps] and inside [absolute].
LOG, LOG_NEAR_ONE = 3.0, 2.0**-21
# The error of exp2(x) is this much, and the second number times |x| [ulps].
EXP, EXP_GROWTH = 3.0, 2.0
# The error of trigonometric functions: of each result [ulps], and of results near zero [absolute].
TRIGONOMETRY, TRIGONOMETRY_NEAR_ZERO = 4.0, 2.0**-21
# The same for the inverse functions: 4096 ulps of a result near 1.
INVERSE, INVERSE_NEAR_ZERO = 4096.0, 2.0**-11


def _with_floor(function: Callable[..., Array], ulps: float, floor: float) -> Operation:
    """Returns a trigonometric function, whose error does not vanish where its result does. floor: that error [absolute]."""

    def operation(arithmetic: Arithmetic, line: int, *operands: Array) -> Array:
        result = function(*operands)
        return arithmetic.rounded(result, line, np.maximum(ulps, _in_ulps(floor, result)))

    return operation


def _in_ulps(error: Array | float, values: Array) -> Array:
    """Returns an absolute error as a number of ulps of values. Zero has no ulp that an error could be a multiple of."""
    return np.divide(error, ULP * np.abs(values), out=np.zeros(np.shape(values)), where=np.abs(values) > 0)


def _logarithm(function: Callable[..., Array], scale: float) -> Operation:
    """Returns a logarithm. scale: the natural logarithm of its base, by which its error near 1 is larger than that of log2."""

    def operation(arithmetic: Arithmetic, line: int, x: Array) -> Array:
        result = function(x)
        near = (x >= 0.5) & (x <= 2.0)
        return arithmetic.rounded(result, line, np.where(near, _in_ulps(LOG_NEAR_ONE * scale, result), LOG))

    return operation


def _exponential(function: Callable[..., Array]) -> Operation:
    def operation(arithmetic: Arithmetic, line: int, x: Array) -> Array:
        return arithmetic.rounded(function(x), line, EXP + EXP_GROWTH * np.abs(x))

    return operation


def _power(arithmetic: Arithmetic, line: int, x: Array, y: Array) -> Array:
    """Returns pow(x, y), whose error is that of exp2(y log2(x)). A negative x is not defined in GLSL, and gives NaN."""
    exponent = y * np.log2(np.where(x > 0, x, 1.0))
    near = (x >= 0.5) & (x <= 2.0)
    # An error e of the exponent is a relative error of ln 2 times e of the power.
    of_exponent = np.log(2) * np.where(near, np.abs(y) * LOG_NEAR_ONE / ULP, (LOG + 0.5) * np.abs(exponent))
    return arithmetic.rounded(
        np.power(np.where(x < 0, x.dtype.type(np.nan), x), y), line, EXP + EXP_GROWTH * np.abs(exponent) + of_exponent
    )


def _length(arithmetic: Arithmetic, line: int, x: Array) -> Array:
    if x.ndim == 1:
        return np.abs(x)
    return arithmetic.rounded(np.sqrt(dot(arithmetic, line, x, x)), line, SQRT)


def _normalise(arithmetic: Arithmetic, line: int, x: Array) -> Array:
    if x.ndim == 1:
        return np.sign(x)
    inverse = arithmetic.rounded(1 / np.sqrt(dot(arithmetic, line, x, x)), line, INVERSE_SQRT)
    return arithmetic.rounded(x * inverse, line)


def _distance(arithmetic: Arithmetic, line: int, a: Array, b: Array) -> Array:
    return _length(arithmetic, line, arithmetic.rounded(a - b, line))


def _inner(arithmetic: Arithmetic, line: int, a: Array, b: Array) -> Array:
    """Returns the dot product of vectors, or the product of scalars."""
    return arithmetic.rounded(a * b, line) if a.ndim == 1 else dot(arithmetic, line, a, b)


def _cross(arithmetic: Arithmetic, line: int, a: Array, b: Array) -> Array:
    first = arithmetic.rounded(a[[1, 2, 0]] * b[[2, 0, 1]], line)
    return arithmetic.rounded(first - arithmetic.rounded(a[[2, 0, 1]] * b[[1, 2, 0]], line), line)


def _mix(arithmetic: Arithmetic, line: int, x: Array, y: Array, a: Array) -> Array:
    """Returns x (1 - a) + y a, the form of the specification.

    Many drivers compute x + a (y - x). Rounding the difference and the product adds an error relative to a (y - x), which may
    be much larger than the result.
    """
    first = arithmetic.rounded(x * arithmetic.rounded(1 - a, line), line)
    result = first + arithmetic.rounded(y * a, line)
    other = ULP * np.abs(a * (y - x))
    return arithmetic.rounded(result, line, np.maximum(NEAREST, _in_ulps(other, result)))


def _smoothstep(arithmetic: Arithmetic, line: int, low: Array, high: Array, x: Array) -> Array:
    t = arithmetic.rounded(arithmetic.rounded(x - low, line) / arithmetic.rounded(high - low, line), line, DIVISION)
    t = np.clip(t, 0, 1)
    return arithmetic.rounded(t * t * arithmetic.rounded(3 - 2 * t, line), line)


def _fma(arithmetic: Arithmetic, line: int, a: Array, b: Array, c: Array) -> Array:
    # A driver may round once or twice; twice is the larger error.
    return arithmetic.rounded(arithmetic.rounded(a * b, line) + c, line)


def _face_forward(arithmetic: Arithmetic, line: int, n: Array, i: Array, reference: Array) -> Array:
    return np.where(_inner(arithmetic, line, reference, i) < 0, n, -n)


def _reflect(arithmetic: Arithmetic, line: int, i: Array, n: Array) -> Array:
    twice = 2 * _inner(arithmetic, line, n, i)
    return arithmetic.rounded(i - arithmetic.rounded(twice * n, line), line)


def _refract(arithmetic: Arithmetic, line: int, i: Array, n: Array, eta: Array) -> Array:
    d = _inner(arithmetic, line, n, i)
    rest = arithmetic.rounded(1 - arithmetic.rounded(eta * eta * arithmetic.rounded(1 - d * d, line), line), line)
    root = arithmetic.rounded(np.sqrt(np.maximum(rest, 0)), line, SQRT)
    factor = arithmetic.rounded(eta * d + root, line)
    bent = arithmetic.rounded(arithmetic.rounded(eta * i, line) - arithmetic.rounded(factor * n, line), line)
    return np.where(rest < 0, 0.0, bent)


def _lanes_first(matrix: Array) -> Array:
    """Returns matrices (columns, rows, n) as (n, rows, columns), the layout of NumPy's linear algebra."""
    return np.moveaxis(matrix, -1, 0).swapaxes(1, 2)


def _determinant(arithmetic: Arithmetic, line: int, matrix: Array) -> Array:
    # The products of a determinant of 4 x 4 are rounded three times, and summed in two steps more.
    return arithmetic.rounded(np.linalg.det(_lanes_first(matrix)), line, 4.0)


def _inverse(arithmetic: Arithmetic, line: int, matrix: Array) -> Array:
    lanes = _lanes_first(matrix)
    regular = np.linalg.det(lanes) != 0
    # The inverse of a singular matrix is undefined.
    safe = np.where(regular[:, None, None], lanes, np.eye(lanes.shape[1]))
    result = np.where(regular[:, None, None], np.linalg.inv(safe), np.nan)
    return arithmetic.rounded(np.moveaxis(result.swapaxes(1, 2), 0, -1), line, 4.0 + DIVISION)


# The smaller and the larger number, as the specification of GLSL writes them: they say what happens with NaN.
def _smaller(x: Array, y: Array) -> Array:
    return np.where(y < x, y, x)


def _larger(x: Array, y: Array) -> Array:
    return np.where(x < y, y, x)


def _clamped(x: Array, low: Array, high: Array) -> Array:
    return _smaller(_larger(x, low), high)


def _fraction(x: Array) -> Array:
    return x - np.floor(x)


FUNCTIONS: dict[int, Operation] = {
    1: exact(np.rint),  # Round: which of two integers a half becomes is left open
    2: exact(np.rint),  # RoundEven
    3: exact(np.trunc),
    4: exact(np.abs),  # FAbs
    5: exact(np.abs),  # SAbs
    6: exact(np.sign),  # FSign
    7: exact(np.sign),  # SSign
    8: exact(np.floor),
    9: exact(np.ceil),
    10: rounded(_fraction),
    11: rounded(np.radians),
    12: rounded(np.degrees),
    13: _with_floor(np.sin, TRIGONOMETRY, TRIGONOMETRY_NEAR_ZERO),
    14: _with_floor(np.cos, TRIGONOMETRY, TRIGONOMETRY_NEAR_ZERO),
    15: rounded(np.tan, 2 * TRIGONOMETRY),
    16: _with_floor(np.arcsin, INVERSE, INVERSE_NEAR_ZERO),
    17: _with_floor(np.arccos, INVERSE, INVERSE_NEAR_ZERO),
    18: rounded(np.arctan, INVERSE),
    19: rounded(np.sinh, TRIGONOMETRY),
    20: rounded(np.cosh, TRIGONOMETRY),
    21: rounded(np.tanh, TRIGONOMETRY),
    22: rounded(np.arcsinh, TRIGONOMETRY),
    23: rounded(np.arccosh, TRIGONOMETRY),
    24: rounded(np.arctanh, TRIGONOMETRY),
    25: rounded(np.arctan2, INVERSE),
    26: _power,
    27: _exponential(np.exp),
    28: _logarithm(np.log, float(np.log(2))),
    29: _exponential(np.exp2),
    30: _logarithm(np.log2, 1.0),
    31: rounded(np.sqrt, SQRT),
    32: rounded(lambda x: 1 / np.sqrt(x), INVERSE_SQRT),
    33: _determinant,
    34: _inverse,
    37: exact(_smaller),  # FMin
    38: exact(np.minimum),  # UMin
    39: exact(np.minimum),  # SMin
    40: exact(_larger),  # FMax
    41: exact(np.maximum),  # UMax
    42: exact(np.maximum),  # SMax
    43: exact(_clamped),  # FClamp
    44: exact(_clamped),  # UClamp
    45: exact(_clamped),  # SClamp
    46: _mix,
    48: exact(lambda edge, x: np.where(x < edge, 0.0, 1.0)),
    49: _smoothstep,
    50: _fma,
    53: exact(lambda x, exponent: np.ldexp(x, exponent)),
    66: _length,
    67: _distance,
    68: _cross,
    69: _normalise,
    70: _face_forward,
    71: _reflect,
    72: _refract,
}
# Built-in functions with two results: Modf writes the whole part to a variable, and FrexpStruct returns a struct.
MODF, FREXP = 35, 52
