"""sRGB: both curves on either side of their knee, for pictures (float32) and for the colours of vertices (float64)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from glshade.image.srgb import linear_to_srgb, srgb_to_linear
from glshade.mesh.reading.colours import srgb_to_linear as srgb_to_linear_float64

# Linear number, encoded number. At the knee and below it, 12.92 times the number; above it, 1.055 c^(1/2.4) - 0.055. Both are
# computed with 30 decimals. At the knee itself, the two differ by 2.9e-8.
ENCODED = [
    (0.0, 0.0),
    (0.003, 0.038760),
    (0.0031308, 0.040449936),
    (0.0032, 0.0413233586270291),
    (0.0034, 0.0437875030603443),
    (0.21404114, 0.5),
]
# Encoded number, linear number. At the knee and below it, the number divided by 12.92; above it, ((c + 0.055) / 1.055)^2.4. At
# the knee itself, the two differ by 2.3e-9.
DECODED = [
    (0.0, 0.0),
    (0.0385, 0.00297987616099071),
    (0.04045, 0.00313080495356037),
    (0.0409, 0.00316634879803549),
    (0.0425, 0.00329461881708295),
    (1.0, 1.0),
]


@pytest.mark.parametrize(("linear", "encoded"), ENCODED)
def test_encoding_around_the_knee(linear: float, encoded: float) -> None:
    assert float(linear_to_srgb(np.array(linear))) == pytest.approx(encoded, abs=2e-8)


@pytest.mark.parametrize("decode", [srgb_to_linear, srgb_to_linear_float64], ids=["float32", "float64"])
@pytest.mark.parametrize(("encoded", "linear"), DECODED)
def test_decoding_around_the_knee(decode: Any, encoded: float, linear: float) -> None:
    assert float(decode(np.array(encoded))) == pytest.approx(linear, abs=1e-9)


def test_vertex_colours_keep_float64() -> None:
    assert float(srgb_to_linear_float64(np.array(0.0425))) == pytest.approx(0.00329461881708294595, rel=1e-14)
