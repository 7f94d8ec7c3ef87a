"""Assumptions: checks the properties that glshade takes for granted of a driver against measurements of the driver at hand."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from glshade.gl.context import Context
from glshade.glsl.plan import PAGE
from glshade.reference.raster import SUBPIXELS

# The largest errors of built-in functions that the bounds of docs/accuracy.md allow [ULP]. For some functions OpenGL allows
# larger errors, but every driver measured so far stays within these.
NEEDED = {"+": 1.0, "-": 1.0, "*": 1.0, "/": 2.5, "sqrt": 3.0, "inversesqrt": 3.0, "exp2": 5.0}


@dataclass(frozen=True)
class Assumption:
    """A property that glshade takes for granted of a driver, either to draw pictures or to prove that they are right.

    what: the property, in words.
    holds: True if the driver has the property.
    measured: the measurement of this driver, in words.
    follows: the consequence for pictures if the driver lacks the property, in words.
    """

    what: str
    holds: bool
    measured: str
    follows: str

    def as_dict(self) -> dict[str, Any]:
        """Returns the assumption as a dictionary ready for JSON."""
        return asdict(self)


def check_assumptions(context: Context, found: dict[str, Any]) -> list[Assumption]:
    """Returns every assumption about the driver of a context. found: the result of `measure` for the same context."""
    return [
        _arithmetic(found["built_ins"]),
        _loops(found["loop_rounds"]),
        *_formats(found["formats"]),
        _depth(context),
        *_rasteriser(found["subpixel_bits"]["measured"], found["interpolation_shift_in_steps"]),
    ]


def _arithmetic(built_ins: dict[str, Any]) -> Assumption:
    errors = {name: built_ins[name]["ulp"] for name in NEEDED}
    exceeded = [name for name, limit in NEEDED.items() if errors[name] > limit]
    return Assumption(
        what=f"arithmetic within {', '.join(f'{name} {limit:g}' for name, limit in NEEDED.items())} ULP",
        holds=not exceeded,
        measured=", ".join(f"{name} {errors[name]:g}" for name in exceeded or NEEDED),
        follows="errors may exceed the bounds in docs/accuracy.md",
    )


def _loops(rounds: dict[str, int]) -> Assumption:
    least = min(rounds["vertex"], rounds["fragment"])
    return Assumption(
        what=f"loops of {PAGE} rounds, for that many lights at once",
        holds=least >= PAGE,
        measured=f"a loop of {rounds['tried']} rounds ends after {least}",
        follows="lights past that number are missing from the picture",
    )


def _formats(formats: dict[str, Any]) -> list[Assumption]:
    exact, error = formats["RGBA32F"]["exact"], formats["RGBA8"]["lsb"]
    return [
        Assumption(
            what="RGBA32F keeps every bit",
            holds=exact,
            measured="every bit is kept" if exact else "stored numbers differ",
            follows="linear pictures differ from the values that the shaders computed",
        ),
        Assumption(
            what="RGBA8 rounds to the nearest code",
            holds=error <= 0.51,
            measured=f"the error is up to {error:g} of a step between codes",
            follows="8-bit pictures may be off by one code; EXR pictures are not affected",
        ),
    ]


def _depth(context: Context) -> Assumption:
    return Assumption(
        what="clip depth from 0 to 1",
        holds=context.zero_to_one,
        measured="glClipControl is available" if context.zero_to_one else "glClipControl is missing",
        follows="distant surfaces that lie close together may flicker, because reversed depth gains no precision",
    )


def _rasteriser(bits: int, shift: float) -> list[Assumption]:
    expected = SUBPIXELS.bit_length() - 1
    return [
        Assumption(
            what=f"corners snap to a grid of {expected} sub-pixel bits or a finer one",
            holds=bits >= expected,
            measured=f"{bits} bits",
            follows="edges are drawn elsewhere than in the reference, so that `glshade verify` calls more pixels ambiguous",
        ),
        Assumption(
            what="attributes are interpolated from corners that are not snapped",
            holds=abs(shift) < 0.1,
            measured=f"they move by {shift:g} of a sub-pixel step, where snapping would move them by 0.4",
            follows="pictures may differ from the reference by as much as a shift of 1/512 pixel changes them",
        ),
    ]
