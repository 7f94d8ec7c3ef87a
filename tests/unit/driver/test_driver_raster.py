"""Measured properties of the rasteriser agree with the driver's own statements and with what is known of llvmpipe."""

from __future__ import annotations

from typing import Any

import pytest

from glshade.driver.raster import FINEST
from glshade.gl.context import Context


def test_every_driver_is_within_the_limits_of_opengl(found: dict[str, Any]) -> None:
    """OpenGL 4.6 core, 14.3 and table 23.53."""
    assert found["subpixel_bits"]["told"] >= 4
    assert all(0 <= x <= 1 for position in found["sample_positions"] for x in position)


def test_the_driver_and_the_measurement_agree(found: dict[str, Any], context: Context) -> None:
    bits = found["subpixel_bits"]
    # softpipe does not snap at all, and reports the least number that OpenGL allows.
    assert bits["measured"] == bits["told"] or bits["measured"] == FINEST
    assert len(found["sample_positions"]) in (0, context.gl.max_samples)


@pytest.mark.usefixtures("llvmpipe")
def test_llvmpipe(found: dict[str, Any]) -> None:
    assert found["subpixel_bits"]["measured"] == 8
    assert found["interpolation_shift_in_steps"] == pytest.approx(0, abs=0.01)
    assert found["clips_at_sides"] is True
