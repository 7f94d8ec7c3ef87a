"""Property: at the ends of every parameter's and direction's range, a model's GLSL is as exact as its float32 inputs let it be.

In both stages, |gpu - float64| is at most FACTOR times the conditioning, which tests/support/extremes.py defines. At ordinary
parameters an error of 2e-6 relative to max(1, |f cos|) is allowed if that is more. docs/accuracy.md lists measured errors.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.extremes import (
    FACTOR,
    ORDINARY,
    STAGES,
    Worst,
    at_extremes,
    conditions,
    exact,
    in_conditioning,
    joined,
    measured,
    ordinary,
    pairs,
    spread,
)

from glshade import BRDFS, Renderer
from glshade.brdfs import Brdf

# Models that need a larger factor than FACTOR: the factor, and the reason.
EXCEPTIONS: dict[str, tuple[float, str]] = {
    "oren_nayar": (10.0, "the terms of C1 and C2 cancel to under 1 % for grazing light seen against the light; measured 6.4"),
}


# On the flank of a narrow lobe most of the allowed error comes from the tilt of the normal. If the normal is exactly +z, it has
# no tilt. Where l and v are more than HIGH above the horizon, this error is then allowed in place of the tilt's, relative to
# max(1, |f cos|). The form pow(dot(n, h), p) has an error of 0.2 there. Measured: 4e-6.
STEADY = 1e-5
HIGH = 1e-3


def check(materials: list[Brdf], renderer: Renderer, floor: float = 0.0) -> None:
    """Checks both stages. floor: the error that is always allowed, relative to max(1, |f cos|)."""
    l, v, case = joined(pairs())
    high = (l[:, 2] > HIGH) & (v[:, 2] > HIGH)
    for material in materials:
        factor = EXCEPTIONS.get(material.brdf, (FACTOR, ""))[0]
        value, inputs, tilt = conditions(material, l, v)
        assert np.isfinite(value).all(), f"the reference of {material!r}"
        relative = np.maximum(1, np.abs(value)) / FACTOR
        for stage in STAGES:
            gpu = measured(material, stage, renderer, l, v)
            any_frame, exact_frame = Worst(), Worst()
            error = in_conditioning(gpu, value, np.maximum(inputs + tilt, floor * relative))
            steady = np.where(high[:, None], in_conditioning(gpu, value, np.maximum(inputs, STEADY * relative)), 0.0)

            def describe(i: int, gpu: Any = gpu, value: Any = value) -> str:
                return f"{case[i]}: l {l[i]}, v {v[i]}, {gpu[i]} for {value[i]}"

            any_frame.add(error, describe)
            exact_frame.add(steady, describe)
            assert any_frame.value <= factor, f"{material!r} in the {stage} stage, {any_frame}"
            assert exact_frame.value <= factor, f"{material!r} in the {stage} stage with the normal exactly +z, {exact_frame}"


@pytest.mark.parametrize("name", BRDFS)
def test_at_the_extremes(name: str, renderer: Renderer) -> None:
    check(spread(at_extremes(name, 48), 16), renderer)


@pytest.mark.slow
@pytest.mark.parametrize("name", BRDFS)
def test_at_all_extremes_together(name: str, renderer: Renderer) -> None:
    check(at_extremes(name, 600), renderer)


@pytest.mark.parametrize("name", BRDFS)
def test_at_ordinary_parameters_in_extreme_directions(name: str, renderer: Renderer) -> None:
    check(ordinary(name, 12), renderer, ORDINARY)


def test_a_wrong_form_is_found(renderer: Renderer) -> None:
    """The check finds the error of pow(dot, p), which takes a rounded cosine, and of an exponent that is 1 % off."""
    l, v, _ = joined(pairs())
    material = BRDFS["phong"](kd=0.0, ks=1.0, exponent=1e6)
    value, conditioning = exact(material, l, v)
    wrong, _ = exact(BRDFS["phong"](kd=0.0, ks=1.0, exponent=1.01e6), l, v)
    assert in_conditioning(wrong, value, conditioning).max() > FACTOR
    cosine = np.float32(np.sum(l * v * np.float32([-1, -1, 1]), axis=1, dtype=np.float32))
    lit = (cosine > 0) & (l[:, 2] > 0) & (v[:, 2] > 0)
    naive = np.where(lit, np.maximum(cosine, 0) ** np.float32(1e6), 0)[:, None] / np.pi
    assert in_conditioning(naive, value, conditioning).max() > FACTOR
