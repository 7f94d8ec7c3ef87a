"""Freedom: measures the errors of a driver's fixed functions, which the reference has to allow for."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from glshade.driver.detail import measure_detail
from glshade.driver.raster import measure_raster
from glshade.errors import ContextError
from glshade.gl.context import Context
from glshade.reference.freedom import LEAST_BITS, UNMEASURED, Freedom
from glshade.reference.raster import SUBPIXELS

# The factor between the largest error that was measured and the error that is allowed. The measurement may miss the worst case.
RESERVE = 1.15
# A smaller error of filter weights is one of float32, which the reference allows for in any case [texels].
FLOAT_WEIGHT = 2.0**-20
# The least error of the level of detail that is allowed for [levels].
LEAST_LEVEL = 2.0**-8
# Attributes count as interpolated from snapped corners if they move by more than this where snapping would move them by 0.4
# [sub-pixel steps].
SNAPPED = 0.1

# (GL_RENDERER, GL_VERSION, backend) -> the Freedom that was measured in this process.
_measured: dict[tuple[str, str, str], Freedom] = {}


def measure_freedom(context: Context) -> Freedom:
    """Returns the Freedom of a context's driver. It is measured once in a process, which takes 70 ms on llvmpipe.

    Errors: ContextError if the driver snaps corners to a coarser grid than OpenGL allows.
    """
    key = (context.renderer, context.version, context.backend)
    if key not in _measured:
        with context.gl:
            found = {**measure_raster(context), **measure_detail(context)}
        _measured[key] = replace(freedom_of(context.renderer, found), samples=context.gl.max_samples)
    return _measured[key]


def freedom_of(name: str, found: dict[str, Any]) -> Freedom:
    """Returns the Freedom that follows from measurements.

    name: the name of the driver.
    found: the results of measure_raster and measure_detail.
    Errors: ContextError if the driver snaps corners to a coarser grid than OpenGL allows.
    """
    bits, shift = found["subpixel_bits"]["measured"], found["interpolation_shift_in_steps"]
    if bits < LEAST_BITS:
        raise ContextError(
            f"pictures of this driver cannot be verified: it snaps corners to 1/{2**bits} pixel, and OpenGL demands "
            f"1/{2**LEAST_BITS} or less"
        )
    # A driver with a finer grid than the reference's moves corners by less than the reference does.
    step = 1 / min(2**bits, SUBPIXELS)
    rule, error = found["level_of_detail"]["rule"], found["level_of_detail"]["error"]
    weight, in_table = found["filter_weight_error"], found["table_weight_error"]
    return Freedom(
        name,
        snap=step if abs(shift) > SNAPPED else 0.0,
        rules=UNMEASURED.rules if rule is None else (rule,),
        level=max(RESERVE * error, LEAST_LEVEL),
        texel=RESERVE * weight if weight > FLOAT_WEIGHT else 0.0,
        table=RESERVE * in_table if in_table > FLOAT_WEIGHT else 0.0,
        decoding=RESERVE * found["srgb_decoding"]["error"],
        decoded=tuple(found["srgb_decoding"]["values"]),
        clips=found["clips_at_sides"] is not False,
        subpixel_bits=bits,
    )
