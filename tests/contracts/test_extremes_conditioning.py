"""Law: at the ends of every parameter and direction, a model's GLSL is as exact as its float32 inputs let it be.

|gpu - float64| <= FACTOR x the conditioning (tests/extremes.py says what that is), in both stages; and, at ordinary parameters,
2e-6 relative to max(1, |f cos|) where that is more. docs/accuracy.md has the figures that were measured.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from extremes import (
    FACTOR,
    ORDINARY,
    STAGES,
    TILT,
    Worst,
    at_extremes,
    exact,
    in_conditioning,
    joined,
    measured,
    ordinary,
    pairs,
)

from glshade import BRDFS, Renderer

# Where FACTOR is not enough: the factor, and the reason.
EXCEPTIONS: dict[str, tuple[float, str]] = {
    "oren_nayar": (10.0, "the terms of C1 and C2 cancel to under 1 % for grazing light seen against the light; measured 6.4"),
}


# With the normal exactly +z, whose rounding excuses most of a narrow lobe: relative to max(1, |f cos|), where l and v are
# farther above the horizon than HIGH. pow(dot(n, h), p) errs by 0.2 there. Measured: 4e-6.
STEADY = 1e-5
HIGH = 1e-3


def check(name: str, materials: list[Any], renderer: Renderer, floor: float, tilt: float = TILT, high: float = -1.0) -> None:
    l, v, case = joined(pairs())
    chosen = (l[:, 2] > high) & (v[:, 2] > high)
    l, v, case = l[chosen], v[chosen], case[chosen]
    for material in materials:
        value, conditioning = exact(material, l, v, tilt)
        assert np.isfinite(value).all(), f"the reference of {material!r}"
        enough = floor * np.maximum(1, np.abs(value)) / FACTOR
        for stage in STAGES:
            worst = Worst()
            gpu = measured(material, stage, renderer, l, v)
            worst.add(
                in_conditioning(gpu, value, np.maximum(conditioning, enough)),
                lambda i, gpu=gpu, value=value: f"{case[i]}: l {l[i]}, v {v[i]}, {gpu[i]} for {value[i]}",
            )
            assert worst.value <= EXCEPTIONS.get(name, (FACTOR, ""))[0], f"{material!r} in the {stage} stage, {worst}"


@pytest.mark.parametrize("name", BRDFS)
def test_at_the_extremes(name: str, renderer: Renderer) -> None:
    check(name, at_extremes(name, 48), renderer, 0.0)


@pytest.mark.parametrize("name", BRDFS)
def test_at_the_extremes_of_an_exact_frame(name: str, renderer: Renderer) -> None:
    check(name, at_extremes(name, 24), renderer, STEADY, 0.0, HIGH)


@pytest.mark.slow
@pytest.mark.parametrize("name", BRDFS)
def test_at_all_extremes_together(name: str, renderer: Renderer) -> None:
    check(name, at_extremes(name, 600), renderer, 0.0)


@pytest.mark.parametrize("name", BRDFS)
def test_at_ordinary_parameters_in_extreme_directions(name: str, renderer: Renderer) -> None:
    check(name, ordinary(name, 12), renderer, ORDINARY)


def test_a_wrong_form_is_found(renderer: Renderer) -> None:
    """pow(dot, p) of a rounded cosine, and an exponent that is 1 % off, do not pass as conditioning."""
    l, v, _ = joined(pairs())
    material = BRDFS["phong"](kd=0.0, ks=1.0, exponent=1e6)
    value, conditioning = exact(material, l, v)
    wrong, _ = exact(BRDFS["phong"](kd=0.0, ks=1.0, exponent=1.01e6), l, v)
    assert in_conditioning(wrong, value, conditioning).max() > FACTOR
    cosine = np.float32(np.sum(l * v * np.float32([-1, -1, 1]), axis=1, dtype=np.float32))
    lit = (cosine > 0) & (l[:, 2] > 0) & (v[:, 2] > 0)
    naive = np.where(lit, np.maximum(cosine, 0) ** np.float32(1e6), 0)[:, None] / np.pi
    assert in_conditioning(naive, value, conditioning).max() > FACTOR
