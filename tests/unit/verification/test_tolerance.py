"""The tolerance that the reference grants a driver is as wide as it was when it was recorded: not wider, and not narrower.

A tolerance that is ten times too wide verifies every right picture and hides wrong ones, so no other test would fail.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import glshade
from glshade.reference import bounds
from glshade.reference.freedom import Freedom
from glshade.verification.candidates import find_candidates, one_sample
from glshade.verification.judgement import PixelClass

SCENES = Path(__file__).resolve().parents[3] / "scenes"
SIZE = (160, 120)
# Half the width of the interval of an interior pixel's widest channel, in linear light: scene -> (median, largest).
# The four scenes show rates, normals and lights of several kinds, a narrow lobe, and textures.
RECORDED = {
    "direction-and-point": (3.406e-6, 3.382e-5),
    "half-angle": (2.269e-6, 1.441e-5),
    "lights-add": (1.494e-6, 1.301e-4),
    "spatial-variation": (2.647e-5, 6.708e-2),
}
# A driver that decodes sRGB codes exactly, or as it was measured to do, which widens nothing.
EXACT = Freedom(decoding=0.0)
# Other NumPy versions round otherwise, which moves the figures by far less than this.
WITHIN = 0.1


def tolerance(name: str, driver: Freedom) -> tuple[float, float]:
    """Returns (median, largest) half-width of the intervals of the scene's interior pixels, in linear light."""
    scene = glshade.load(SCENES / f"{name}.toml")
    scene = scene.model_copy(update={"film": scene.film.model_copy(update={"size": SIZE})})
    expected = find_candidates(one_sample(scene), driver=driver).expected
    interior = expected.classes[expected.pixel] == PixelClass.INTERIOR
    assert interior.sum() > 1000
    half_width = ((expected.high - expected.low) / 2)[interior, :3].max(axis=1)
    return float(np.median(half_width)), float(half_width.max())


@pytest.mark.parametrize("name", RECORDED)
def test_the_width_is_as_recorded(name: str) -> None:
    assert tolerance(name, EXACT) == pytest.approx(RECORDED[name], rel=WITHIN)


@pytest.mark.parametrize("factor", [0.1, 10])
@pytest.mark.parametrize(("constant", "name"), [("AGAIN", "lights-add"), ("STEPS", "direction-and-point")])
def test_another_constant_changes_the_width(constant: str, name: str, factor: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """The recorded widths are sensitive to the constants that they guard."""
    monkeypatch.setattr(bounds, constant, factor * getattr(bounds, constant))
    assert tolerance(name, EXACT) != pytest.approx(RECORDED[name], rel=WITHIN)


@pytest.mark.parametrize("key", ["plane", "window"])
@pytest.mark.parametrize("roundings", [1.0, 4.0])
def test_another_driver_changes_the_width(key: str, roundings: float) -> None:
    """Freedom.plane and Freedom.window are 2 roundings for the driver that the widths are recorded for."""
    driver = replace(EXACT, **{key: roundings})
    assert tolerance("direction-and-point", driver) != pytest.approx(RECORDED["direction-and-point"], rel=WITHIN)


def test_another_level_of_detail_changes_the_width() -> None:
    """Freedom.level widens the intervals of textured surfaces."""
    assert tolerance("spatial-variation", replace(EXACT, level=0.1)) != pytest.approx(RECORDED["spatial-variation"], rel=WITHIN)
