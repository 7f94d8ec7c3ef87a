"""Variables: the values of a program's variables, for pages: at one pixel as texts, or at all pixels as a picture."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.debug.tracing import TracedStep
from glshade.live.source import short_name
from glshade.page.ramp import RAMP, colours
from glshade.spirv.digits import Digits
from glshade.spirv.trace import short

Array = NDArray[Any]
Table = dict[str, Any]

# Nine digits tell any two float32 numbers apart.
DIGITS = 9
# A page lists this many steps of a pixel. The longest program of the shipped scenes has some 400; a loop over many lights has
# more, which nobody reads.
MOST_STEPS = 2000
# The colour of pixels whose value is NaN or infinite: magenta, which the scale does not have.
NOT_FINITE = (255, 0, 255)
# A line is worth an underline if it loses more decimal digits than this: four of the seven of float32 are then left, and the
# error is a quarter of the step between two 8-bit codes of the brightest light.
UNDERLINED = 3.0


def step_tables(steps: Sequence[TracedStep]) -> list[Table]:
    """Returns a table for each of the first MOST_STEPS steps, as `messages.Traced` lists them."""
    times: Counter[tuple[str, str]] = Counter()
    tables = []
    for step in steps[:MOST_STEPS]:
        key = step.place, step.name
        file, _, line = step.place.rpartition(":")
        tables.append(
            {
                "file": file,
                "short": short_name(file),
                "line": int(line or 0),
                "text": step.text,
                "name": step.name,
                "number": times[key],
                "type": step.type,
                "float64": short(step.float64, DIGITS),
                "float32": short(step.float32, DIGITS),
                "digits": step.digits,
                "picture": not isinstance(step.float64, tuple) and np.ndim(step.float64) <= 1,
            }
        )
        times[key] += 1
    return tables


def line_tables(digits: Digits) -> list[Table]:
    """Returns a table for each line that loses more than UNDERLINED digits, as `messages.LostDigits` lists them."""
    tables = []
    for loss in digits.lines:
        if loss.digits > UNDERLINED:
            file, _, line = loss.place.rpartition(":")
            facts = {"text": loss.text, "digits": loss.digits, "ill_posed": loss.ill_posed}
            tables.append({"file": file, "line": int(line or 0), **facts})
    return tables


def variable_picture(values: Array, name: str, present: NDArray[np.bool_]) -> tuple[Array, Table]:
    """Returns the values of a variable as a picture (H, W, 4) uint8 with straight alpha, and its scale for `messages.Frame`.

    A number is shown by the colours of the heat map; the components of a vector are red, green and blue.
    values: (H, W, C).
    name: the name of the variable.
    present: (H, W), True for the pixels that have a value.
    """
    finite: NDArray[np.bool_] = np.asarray(np.isfinite(values).all(axis=2))
    shown = values[finite & present]
    low, high = (float(shown.min()), float(shown.max())) if len(shown) else (0.0, 0.0)
    # Where all values are the same, they have the colour in the middle of the scale.
    place = (np.where(finite[..., None], values, low) - low) / (high - low) if high > low else np.full(values.shape, 0.5)
    if values.shape[2] == 1:
        codes = colours(place[..., 0])
        scale = [*RAMP]
        text = f"{name}, float64"
    else:
        codes = np.zeros((*values.shape[:2], 3), np.uint8)
        codes[..., : values.shape[2]] = np.rint(255 * place[..., :3])
        scale = [np.zeros(3), np.full(3, 255.0)]
        text = f"{name}, float64: x, y and z are red, green and blue"
    codes[~finite] = NOT_FINITE
    picture = np.concatenate([codes, np.where(present, 255, 0).astype(np.uint8)[..., None]], axis=2)
    return picture, {"low": low, "high": high, "text": text, "colours": hexadecimal(scale)}


def hexadecimal(colours: Sequence[Array]) -> list[str]:
    """Returns colours (3,) of codes from 0 to 255 as texts such as #ff8000."""
    return ["#" + "".join(f"{int(code):02x}" for code in colour) for colour in colours]
