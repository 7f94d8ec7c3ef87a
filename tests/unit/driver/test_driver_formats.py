"""Measured pixel formats agree with what OpenGL demands and with what is known of llvmpipe."""

from __future__ import annotations

from typing import Any

import pytest


def test_every_driver_is_within_the_limits_of_opengl(found: dict[str, Any]) -> None:
    formats = found["formats"]
    assert formats["RGBA8"]["lsb"] <= 1
    assert formats["RGB10_A2"]["lsb"] <= 1
    assert formats["RGBA16F"]["relative"] <= 2.0**-10
    assert formats["R11F_G11F_B10F"]["relative"] <= 2.0**-6


@pytest.mark.usefixtures("llvmpipe")
def test_llvmpipe(found: dict[str, Any]) -> None:
    assert found["formats"]["RGBA16F"]["rounding"] == "toward zero"
    assert found["formats"]["SRGB8_ALPHA8"]["lsb"] < 1, "the encoding is made when the target stores, and made once"
