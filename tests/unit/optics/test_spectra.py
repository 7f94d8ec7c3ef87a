"""Spectra, their colours, and the files that hold them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from glshade.brdfs import BRDFS
from glshade.errors import AssetError
from glshade.optics.observer import WAVELENGTHS, daylight, matching, reflected, rgb_weights, sampled, weights_for
from glshade.optics.spectra import ILLUMINANTS, Spectrum, rows_of
from glshade.optics.upsampling import spectrum_of

# Chromaticities x, y of the illuminants for the 2-degree observer (CIE 015:2018, tables of illuminants), to four digits.
PUBLISHED = {"A": (0.4476, 0.4074), "D65": (0.3127, 0.3290), "F2": (0.3721, 0.3751), "F11": (0.3805, 0.3769)}


def spectrum(**keys: Any) -> Spectrum:
    return Spectrum.model_validate(keys)


def fault_of(**keys: Any) -> str:
    with pytest.raises(ValidationError) as caught:
        Spectrum.model_validate(keys)
    (error,) = caught.value.errors(include_url=False)
    return str(error["msg"])


@pytest.mark.parametrize("name", ILLUMINANTS)
def test_illuminants_have_their_published_chromaticities(name: str) -> None:
    xyz = spectrum(spectrum=name).light() @ matching()
    assert xyz[1] == pytest.approx(1, abs=1e-12)
    # Their tables end at 780 nm or have steps of 5 nm, which moves the chromaticity of F11 by 2.3e-4.
    assert xyz[:2] / xyz.sum() == pytest.approx(PUBLISHED[name], abs=3e-4)


def test_a_reflectance_of_1_under_daylight_is_white() -> None:
    np.testing.assert_allclose(daylight() @ rgb_weights(), 1, atol=1e-12)
    assert spectrum(spectrum="D65").colour(lit=False) == (1.0, 1.0, 1.0)
    assert spectrum(spectrum=[[300, 1], [830, 1]]).colour(lit=True) == (1.0, 1.0, 1.0)


@pytest.mark.parametrize("name", ILLUMINANTS)
def test_a_white_of_its_own_is_white(name: str) -> None:
    light = spectrum(spectrum=name).light()
    np.testing.assert_allclose(light @ weights_for(light), 1, atol=1e-9)
    np.testing.assert_allclose(weights_for(daylight()), rgb_weights(), atol=1e-9)


def test_a_blackbody_of_the_temperature_of_illuminant_a_has_nearly_its_colour() -> None:
    near = spectrum(blackbody=2856).colour(lit=False)
    assert near == pytest.approx(spectrum(spectrum="A").colour(lit=False), abs=1e-3)
    red, _, blue = spectrum(blackbody=10000).colour(lit=False)
    assert blue > red


def test_light_has_the_luminance_of_its_scale_whatever_its_unit() -> None:
    once, thousandfold = (spectrum(spectrum=[[400, k], [700, 2 * k]]).light() for k in (1, 1000))
    np.testing.assert_allclose(once, thousandfold, rtol=1e-12)
    assert spectrum(spectrum=[[400, 1], [700, 2]], scale=3).light() @ matching()[:, 1] == pytest.approx(3)


def test_light_that_is_hardly_visible_has_the_power_of_daylight() -> None:
    assert spectrum(spectrum=[[340, 0], [365, 5], [390, 0]]).light().sum() == pytest.approx(daylight().sum())
    assert not spectrum(spectrum=[[400, 0], [700, 0]]).light().any()


def test_tables_are_linear_between_their_rows_and_0_or_held_beyond() -> None:
    table = spectrum(spectrum=[[400, 0.2], [500, 0.4]])
    values = table.values()
    assert values[WAVELENGTHS == 450] == pytest.approx(0.3)
    assert values[WAVELENGTHS < 400].max() == values[WAVELENGTHS > 500].max() == 0
    held = table.values(held=True)
    assert (held[0], held[-1]) == (0.2, 0.4)


@settings(max_examples=20)
@given(st.lists(st.floats(0, 1), min_size=5, max_size=5))
def test_reflected_is_the_sum_over_wavelengths(values: list[float]) -> None:
    rows = np.array([400.0, 450.0, 520.0, 600.0, 700.0])
    by_hand = (daylight() * sampled(rows, np.array(values))) @ rgb_weights()
    np.testing.assert_allclose(reflected(rows, np.array(values)), by_hand, atol=1e-12)


CHANNEL = st.floats(0, 1)


@settings(max_examples=40)
@given(st.tuples(CHANNEL, CHANNEL, CHANNEL))
def test_colours_become_reflectances_that_have_them(colour: tuple[float, float, float]) -> None:
    curve = spectrum_of(colour)
    assert curve.min() >= 0
    assert curve.max() <= 1
    np.testing.assert_allclose((daylight() * curve) @ rgb_weights(), colour, atol=1e-6)


@settings(max_examples=40)
@given(st.tuples(*[st.floats(-3, 30)] * 3))
def test_bright_and_negative_colours_come_back_too(colour: tuple[float, float, float]) -> None:
    np.testing.assert_allclose((daylight() * spectrum_of(colour)) @ rgb_weights(), colour, atol=1e-5)


def test_the_corners_of_the_colour_cube_come_back() -> None:
    for corner in np.ndindex(2, 2, 2):
        np.testing.assert_allclose((daylight() * spectrum_of(corner)) @ rgb_weights(), corner, atol=1e-6)


def test_greys_are_flat() -> None:
    assert np.ptp(spectrum_of((0.18, 0.18, 0.18))) == 0


def test_faults_are_told_in_one_line() -> None:
    assert fault_of(spectrum="F3") == 'no file and no illuminant is named "F3"; allowed: A, D65, F11, F2'
    assert fault_of(spectrum="/nowhere.spd") == "/nowhere.spd does not exist"
    assert "nanometres" in fault_of(spectrum=[[0.3, 1], [0.7, 1]])
    assert "ascend" in fault_of(spectrum=[[400, 1], [400, 1]])
    assert "negative" in fault_of(spectrum=[[400, 1], [500, -1]])
    assert "finite" in fault_of(spectrum=[[400, 1], [500, float("nan")]])
    assert "at least two" in fault_of(spectrum=[[400, 1]])
    assert "pair" in fault_of(spectrum=[[400, 1, 2], [500, 1, 2]])
    assert fault_of(spectrum=5) == "must be a name, a file, or a list of pairs [nm, value], not 5"
    assert "from 500 to 1e+06" in fault_of(blackbody=20)
    assert "together" in fault_of(blackbody=3000, spectrum="A")
    assert "larger than 1e+100" in fault_of(spectrum=[[400, 1], [500, 1e101]])
    assert "at least 1e-100" in fault_of(spectrum=[[400, 1e-310], [500, 1e-310]])


@pytest.mark.parametrize("keys", [{}, {"spectrum": None}, {"blackbody": None}, {"scale": 2}])
def test_a_spectrum_without_values_is_a_fault(keys: dict[str, Any]) -> None:
    assert fault_of(**keys) == "is required"


@settings(max_examples=20)
@given(st.lists(st.floats(1e-100, 1e100), min_size=3, max_size=3))
def test_tables_in_any_unit_are_lights_without_overflow(values: list[float]) -> None:
    power = spectrum(spectrum=list(zip((400, 550, 700), values, strict=True))).light()
    assert np.isfinite(power).all()
    assert power.max() > 0


@pytest.mark.parametrize("key", ["spectru", "Spectrum", "black_body"])
def test_a_misspelt_spectrum_is_named(key: str) -> None:
    with pytest.raises(ValidationError) as caught:
        BRDFS["lambert"].model_validate({"brdf": "lambert", "kd": {key: 3000}})
    assert {error["loc"][0] for error in caught.value.errors()} == {"kd"}
    assert not any("texture" in error["loc"] for error in caught.value.errors())


TABLE = "# made up\nwavelength,value\n400,0.1\n500;0.2\n600 0.3\n"


def test_files_have_two_numbers_a_line(tmp_path: Path) -> None:
    (tmp_path / "paint.spd").write_text(TABLE, encoding="utf-8")
    wavelengths, values = rows_of(tmp_path / "paint.spd")
    np.testing.assert_array_equal([wavelengths, values], [[400, 500, 600], [0.1, 0.2, 0.3]])
    # A file that changes is read again.
    (tmp_path / "paint.spd").write_text(TABLE + "700 0.4\n", encoding="utf-8")
    assert rows_of(tmp_path / "paint.spd")[0][-1] == 700


@pytest.mark.parametrize(
    "text",
    [
        "",
        "400",
        "400 1\n500 x\n",
        "400 1\n500 1 2\n",
        "title\ntitle\n400 1\n500 1\n",
        "500 1\n400 1\n",
        "1e999 1\n400 1\n",
        "\0\0",
    ],
)
def test_damaged_files_are_refused_in_one_line_with_their_name(text: str, tmp_path: Path) -> None:
    (tmp_path / "bad.spd").write_text(text, encoding="utf-8")
    with pytest.raises(AssetError) as caught:
        rows_of(tmp_path / "bad.spd")
    (problem,) = caught.value.problems
    assert problem.startswith(str(tmp_path / "bad.spd"))


def test_long_files_are_refused_before_they_are_read(tmp_path: Path) -> None:
    with (tmp_path / "long.spd").open("wb") as file:
        file.truncate(1 << 30)
    with pytest.raises(AssetError, match="larger than"):
        rows_of(tmp_path / "long.spd")
