"""Measurement: measures all properties of a driver that `glshade doctor` reports.

Properties are determined by drawing, and not by asking the driver, because the driver's answers may be wrong. Results are
numbers, or yes and no, so that two machines can be compared.
"""

from __future__ import annotations

from typing import Any

from glshade.driver.arithmetic import measure_arithmetic
from glshade.driver.clock import measure_timer_query
from glshade.driver.detail import measure_detail
from glshade.driver.formats import measure_formats
from glshade.driver.raster import measure_raster
from glshade.errors import ContextError, ShaderError
from glshade.gl.context import Context


def measure(context: Context) -> dict[str, Any]:
    """Returns all measurements as one dictionary ready for JSON. The measure_... functions that are called describe its keys.

    context: a context that is used for nothing else. The GL objects made here are freed when it is released.
    Errors: ContextError if the driver refuses a shader or a format.
    """
    try:
        with context.gl:
            arithmetic = measure_arithmetic(context)
            formats = measure_formats(context)
            timer_query = measure_timer_query(context)
            raster = measure_raster(context)
            detail = measure_detail(context)
    except ShaderError as error:
        raise ContextError(f"the driver refuses a shader that measures it: {' '.join(str(error).split())}") from None
    return {**arithmetic, "formats": formats, "timer_query": timer_query, **raster, **detail}
