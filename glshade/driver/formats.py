"""Formats: measures how each pixel format rounds a float32 value that is drawn into it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.driver.figures import rounded
from glshade.driver.programs import COVER, load_program
from glshade.gl.context import Context
from glshade.gl.frame import Storage
from glshade.gl.screen import Encoded, Screen
from glshade.image.srgb import linear_to_srgb

Float32 = NDArray[np.float32]

# The random colours fill a square with this side [pixels].
SIDE = 64


def measure_formats(context: Context) -> dict[str, dict[str, Any]]:
    """Returns OpenGL's name of a format -> a dictionary about its rounding, ready for JSON. It has some of these keys:

    "exact": whether every bit is kept.
    "rounding": the direction of rounding.
    "relative": the largest relative error.
    "bias": the mean relative error, positive if values grow away from zero.
    "70000": the half float that 70000 is stored as; 70000 is beyond the largest half float.
    "negative": the lowest value that negative numbers are stored as.
    "lsb": the largest error, in steps between two integer codes.
    Errors: ShaderError, ContextError.
    """
    program = load_program(context, COVER, "driver/copy.frag")

    def store(storage: Storage | Encoded, samples: Float32) -> Float32:
        """Draws samples (N, 4) into a screen of that format, and returns the values read back (N, 4)."""
        screen = Screen(context, (SIDE, SIDE), storage)
        screen.upload(samples.reshape(SIDE, SIDE, 4))
        screen.draw(program)
        return screen.readback().reshape(-1, 4)

    signed, positive, unit = _samples()
    half = store("rgba16f", signed)[:, :3]
    small = store("r11f_g11f_b10f", positive)[:, :2]
    negative = store("r11f_g11f_b10f", -positive)[:, :3]
    encoded = linear_to_srgb(unit[:, :3].astype(np.float64))
    return {
        "RGBA32F": {"exact": bool(np.array_equal(store("rgba32f", signed), signed))},
        "RGBA16F": {**_float_rounding(half[2:], signed[2:, :3], 10), "70000": rounded(half[0, 0])},
        "R11F_G11F_B10F": {**_float_rounding(small, positive[:, :2], 6), "negative": rounded(negative.min())},
        "RGB10_A2": {"lsb": _code_error(store("rgb10_a2", unit)[:, :3], unit[:, :3], 1023)},
        "RGBA8": {"lsb": _code_error(store("rgba8", unit), unit, 255)},
        "SRGB8_ALPHA8": {"lsb": _code_error(store("srgb8_alpha8", unit)[:, :3], encoded, 255)},
    }


def _samples() -> tuple[Float32, Float32, Float32]:
    """Returns (signed, positive, unit): random colours, (SIDE * SIDE, 4) each.

    signed: numbers of both signs over 18 octaves. The first two colours are 70000, which is beyond the largest half float, and
        2^-30, which is below the smallest one.
    positive: the same numbers without signs and without these two colours.
    unit: numbers from 0 to 1.
    """
    random = np.random.default_rng(2)
    positive = np.ones((SIDE * SIDE, 4), dtype=np.float32)
    positive[:, :3] = 2.0 ** random.uniform(-9, 9, (SIDE * SIDE, 3))
    signed = positive.copy()
    signed[::2, :3] *= -1
    signed[0, :3], signed[1, :3] = 70000.0, 2.0**-30
    return signed, positive, random.uniform(0, 1, (SIDE * SIDE, 4)).astype(np.float32)


def _float_rounding(stored: Float32, given: Float32, bits: int) -> dict[str, Any]:
    """Returns "rounding", "relative" and "bias" of floats, as `measure_formats` explains them.

    stored: (N, channels), the floats as they were read back.
    given: (N, channels), the floats before they were drawn.
    bits: the number of bits of the format's mantissa after the point.
    """
    wide, exact = stored.astype(np.float64), given.astype(np.float64)
    step = 2.0 ** (np.floor(np.log2(np.abs(exact))) - bits)
    if np.array_equal(wide, np.rint(exact / step) * step):
        rounding = "nearest"
    elif np.array_equal(wide, np.trunc(exact / step) * step):
        rounding = "toward zero"
    else:
        rounding = "neither nearest nor toward zero"
    error = (wide - exact) / np.abs(exact)
    return {"rounding": rounding, "relative": rounded(np.abs(error).max()), "bias": rounded((error * np.sign(exact)).mean())}


def _code_error(stored: Float32, exact: NDArray[Any], largest: int) -> float:
    """Returns the largest error of normalised integers, in steps between two codes.

    stored: the numbers from 0 to 1 as they were read back.
    exact: the numbers before they were drawn.
    largest: the code that stands for 1.
    """
    return rounded(np.abs(stored * float(largest) - exact * float(largest)).max())
