"""The errors that the reference allows a driver follow from measurements, and not from the driver's name."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from glshade.driver import freedom
from glshade.driver.freedom import freedom_of, measure_freedom
from glshade.errors import ContextError
from glshade.gl.context import Context
from glshade.reference.freedom import LLVMPIPE, UNMEASURED, Freedom
from glshade.reference.raster import SUBPIXELS

SCENES = Path(__file__).resolve().parents[3] / "scenes"
# A driver without errors would be measured like this.
PERFECT: dict[str, Any] = {
    "subpixel_bits": {"told": 8, "measured": 8},
    "interpolation_shift_in_steps": 0.0,
    "clips_at_sides": False,
    "level_of_detail": {"rule": "length", "error": 0.0},
    "filter_weight_error": 0.0,
    "srgb_decoding": {"error": 0.0, "values": [0.0] * 256},
    "table_weight_error": 0.0,
}


@pytest.mark.usefixtures("llvmpipe")
def test_llvmpipe_is_measured_to_have_the_errors_that_its_tolerance_was_recorded_with(context: Context) -> None:
    measured = measure_freedom(context)
    assert measured.name == context.renderer
    assert (measured.plane, measured.window, measured.snap) == (LLVMPIPE.plane, LLVMPIPE.window, LLVMPIPE.snap)
    assert (measured.rules, measured.texel, measured.clips) == (LLVMPIPE.rules, LLVMPIPE.texel, LLVMPIPE.clips)
    assert measured.table == LLVMPIPE.table
    # llvmpipe decodes sRGB by a polynomial, which is off by up to 0.34 codes.
    assert 0.34 < measured.decoding <= LLVMPIPE.decoding
    assert len(measured.decoded) == 256
    # JSON holds the error in place of the values.
    assert Freedom.from_dict(measured.as_dict()) == replace(measured, decoded=())
    # The logarithm of llvmpipe is off by up to half of the largest value of log2(1 + m) - m.
    assert 0.0430 < measured.level <= LLVMPIPE.level


def test_a_driver_is_measured_once(context: Context, monkeypatch: pytest.MonkeyPatch) -> None:
    first = measure_freedom(context)
    monkeypatch.setattr(freedom, "measure_raster", None)
    assert measure_freedom(context) is first


def test_a_driver_without_errors() -> None:
    perfect = freedom_of("perfect", PERFECT)
    assert (perfect.snap, perfect.texel, perfect.clips, perfect.rules) == (0, 0, False, ("length",))
    assert 0 < perfect.level < 0.01


# A case -> a key of the measurements, its value, and the fields of Freedom that follow from it.
CASES: dict[str, tuple[str, Any, dict[str, Any]]] = {
    "a coarser grid": ("subpixel_bits", {"told": 4, "measured": 4}, {"subpixel_bits": 4, "snap": 0.0}),
    "a finer grid": ("subpixel_bits", {"told": 10, "measured": 10}, {"subpixel_bits": 10}),
    "snapped corners": ("interpolation_shift_in_steps", 0.4, {"snap": 1 / SUBPIXELS}),
    "corners snapped the other way": ("interpolation_shift_in_steps", -0.4, {"snap": 1 / SUBPIXELS}),
    "clipping": ("clips_at_sides", True, {"clips": True}),
    "clipping that cannot be seen": ("clips_at_sides", None, {"clips": True}),
    "weights of 8 bits": ("filter_weight_error", 1 / 512, {"texel": pytest.approx(1 / 512, rel=0.2)}),
    "weights of 8 bits in tables": ("table_weight_error", 1 / 512, {"table": pytest.approx(1 / 512, rel=0.2)}),
    "another rule": (
        "level_of_detail",
        {"rule": "largest", "error": 0.02},
        {"rules": ("largest",), "level": pytest.approx(0.023)},
    ),
    "no known rule": ("level_of_detail", {"rule": None, "error": 0.0}, {"rules": UNMEASURED.rules}),
}


@pytest.mark.parametrize("name", CASES)
def test_an_error_that_is_measured_is_allowed(name: str) -> None:
    key, value, fields = CASES[name]
    measured: Freedom = freedom_of("", {**PERFECT, key: value})
    assert {field: getattr(measured, field) for field in fields} == fields


def test_a_grid_coarser_than_opengl_allows_cannot_be_judged() -> None:
    with pytest.raises(ContextError, match="1/8 pixel, and OpenGL demands 1/16"):
        freedom_of("coarse", {**PERFECT, "subpixel_bits": {"told": 3, "measured": 3}})


def test_corners_snapped_to_a_coarse_grid_move_the_attributes_by_a_step_of_it() -> None:
    coarse = {"subpixel_bits": {"told": 4, "measured": 4}, "interpolation_shift_in_steps": 0.4}
    assert freedom_of("coarse", {**PERFECT, **coarse}).snap == 1 / 16


@pytest.mark.parametrize("name", ["detail", "spatial-variation"])
def test_softpipe_takes_the_least_level_of_detail_that_opengl_allows(name: str, context: Context, glshade: Any) -> None:
    """Mesa reads the variable only once in a process, so softpipe needs a process of its own."""
    if "Mesa" not in context.version:
        pytest.skip(f"softpipe is a driver of Mesa, and this one is {context.version}")
    options = ("--size", "160x120", "--set", "film.samples=1", "--shading", "phong", "--json")
    verdict = json.loads(glshade("verify", SCENES / f"{name}.toml", *options, GALLIUM_DRIVER="softpipe").stdout)
    if "softpipe" not in verdict["driver"]:
        pytest.skip("this build of Mesa has no softpipe")
    assert (verdict["verdict"], verdict["reasons"]) == ("verified", [])
