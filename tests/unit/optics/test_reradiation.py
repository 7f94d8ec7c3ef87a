"""Reradiation: the matrices of fluorescent surfaces, and the energy that they give off."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glshade.errors import AssetError
from glshade.image.image import Image
from glshade.optics.observer import WAVELENGTHS, daylight
from glshade.optics.reradiation import Reradiation, matrix_of

EXCITATION, EMISSION = [340, 360, 380], [430, 450, 470, 490]


def write(path: Path, values: Any, corner: str = "ex \\ em") -> Path:
    rows = [",".join([corner, *map(str, EMISSION)])]
    rows += [",".join([str(x), *(repr(float(v)) for v in row)]) for x, row in zip(EXCITATION, values, strict=True)]
    path.write_text("# a dye\n" + "\n".join(rows) + "\n", encoding="utf-8")
    return path


def write_exr(path: Path, factors: Any) -> Path:
    """Writes a bispectral EXR file of radiance factors (height, width, 3, 4), beside reflectances that are not to be read."""
    height, width = np.shape(factors)[:2]
    pairs = [(f"T.{x},000000nm.{y},000000nm", i, k) for i, x in enumerate(EXCITATION) for k, y in enumerate(EMISSION)]
    spec = oiio.ImageSpec(width, height, len(pairs) + 1, oiio.FLOAT)
    spec.channelnames = ("T.430,000000nm", *(name for name, _, _ in pairs))
    planes = [np.full((height, width), 0.7), *(np.asarray(factors)[:, :, i, k] for _, i, k in pairs)]
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec)
    assert output.write_image(np.stack(planes, axis=2).astype(np.float32))
    output.close()
    return path


def dye(path: Path, values: Any) -> Reradiation:
    return Reradiation.model_validate({"file": write(path / "dye.csv", values)})


def test_the_first_column_excites_and_the_first_row_is_emitted(tmp_path: Path) -> None:
    values = np.arange(12.0).reshape(3, 4) / 1000
    matrix = dye(tmp_path, values).matrix()
    at = {wavelength: int(np.flatnonzero(wavelength == WAVELENGTHS)[0]) for wavelength in (*EXCITATION, *EMISSION, 350, 440)}
    for i, excited in enumerate(EXCITATION):
        for k, emitted in enumerate(EMISSION):
            assert matrix[at[excited], at[emitted]] == pytest.approx(values[i, k])
            # The transposed matrix would be excited by visible light.
            assert matrix[at[emitted], at[excited]] == 0
    assert matrix[at[350], at[440]] == pytest.approx(values[:2, :2].mean())


def test_emission_is_matrix_times_light(tmp_path: Path) -> None:
    values = np.array([[1, 2, 3, 4], [5, 6, 7, 8], [4, 3, 2, 1]]) / 1000
    found = dye(tmp_path, values)
    by_hand = np.zeros(len(WAVELENGTHS))
    for row, power in zip(found.matrix(), daylight(), strict=True):
        by_hand += power * row
    np.testing.assert_allclose(found.emitted(daylight()), by_hand, rtol=1e-12)
    assert by_hand.any()


def test_a_pixel_of_a_bispectral_file_is_read(tmp_path: Path) -> None:
    factors = np.random.default_rng(1).uniform(0, 0.1, (2, 3, 3, 4))
    path = write_exr(tmp_path / "dyes.exr", factors)
    for pixel in ((0, 0), (2, 1)):
        excitation, emission, values = matrix_of(path, pixel)
        assert (excitation.tolist(), emission.tolist()) == (EXCITATION, EMISSION)
        # The bands are 20 nm wide.
        np.testing.assert_allclose(values, factors[pixel[1], pixel[0]] / 20, rtol=1e-6)
    read = Reradiation.model_validate({"file": path, "pixel": (2, 1), "scale": 0.5})
    np.testing.assert_allclose(read.matrix(), 0.5 * dye(tmp_path, factors[1, 2] / 20).matrix(), rtol=1e-6)


@pytest.mark.parametrize(
    ("pixel", "suffix", "says"),
    [((3, 0), "exr", "has 3 x 2 pixels, and none at [3, 0]"), ((0, 2), "exr", "none at [0, 2]"), ((1, 0), "csv", "no pixels")],
)
def test_a_pixel_that_is_not_there_is_refused(pixel: Any, suffix: str, says: str, tmp_path: Path) -> None:
    path = write_exr(tmp_path / "a.exr", np.zeros((2, 3, 3, 4)))
    path = path if suffix == "exr" else write(tmp_path / "a.csv", np.zeros((3, 4)))
    with pytest.raises(ValueError, match=re.escape(says)):
        Reradiation.model_validate({"file": path, "pixel": pixel})


def test_other_exr_files_are_refused_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "rgb.exr"
    Image(np.zeros((2, 2, 3), np.float32)).save(path)
    with pytest.raises(AssetError, match="has no bispectral channels such as"):
        matrix_of(path)
    path.write_bytes(path.read_bytes()[:60])
    with pytest.raises(AssetError, match="cannot be read as an EXR file"):
        matrix_of(path)
    whole = write_exr(tmp_path / "whole.exr", np.random.default_rng(2).uniform(0, 1, (2, 3, 3, 4))).read_bytes()
    path.write_bytes(whole[:-40])
    with pytest.raises(AssetError, match="cannot be read"):
        matrix_of(path)


@settings(max_examples=25)
@given(st.lists(st.floats(0, 0.05), min_size=12, max_size=12), st.floats(0, 1), st.integers(0, 2**32 - 1))
def test_energy_never_grows_unless_it_is_said(tmp_path_factory: Any, values: list[float], grey: float, seed: int) -> None:
    """Law: where no excess is found, no light loses less than nothing."""
    path = tmp_path_factory.mktemp("dye")
    found = dye(path, np.reshape(values, (3, 4)))
    light = np.random.default_rng(seed).random(len(WAVELENGTHS))
    excess = found.excess(np.full(len(WAVELENGTHS), grey))
    out = grey * light.sum() + found.emitted(light).sum()
    if excess is None:
        assert out <= light.sum() * (1 + 2e-6)
    else:
        wavelength, ratio = excess
        alone = np.where(wavelength == WAVELENGTHS, 1.0, 0.0)
        assert grey + found.emitted(alone).sum() == pytest.approx(ratio)
        assert ratio > 1


def test_emission_of_shorter_waves_is_found(tmp_path: Path) -> None:
    rows = [[0, 0, 0, 0.01]] * 3
    assert dye(tmp_path, rows).shorter() is None
    path = tmp_path / "wrong.csv"
    path.write_text("x,400,450\n420,0.001,0.001\n440,0.002,0\n", encoding="utf-8")
    assert Reradiation.model_validate({"file": path}).shorter() == (440, 400)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "at least two"),
        ("x,430,450\n", "at least two"),
        ("x,430,450\n340,1,x\n360,1,1\n", ":2: holds a cell that is no number"),
        ("x,430,450\n340,0,0\n360,0\n", ":3: has 1 yields"),
        ("x,430,450\n360,0,0\n340,0,0\n", "wavelengths of excitation must ascend"),
        ("x,450,430\n340,0,0\n360,0,0\n", "wavelengths of emission must ascend"),
        ("x,0.43,0.45\n340,0,0\n360,0,0\n", "nanometres"),
        ("x,430,450\n340,0,-1\n360,0,0\n", "from 340 nm to 450 nm is negative"),
        ("x,430,450\n340,0,nan\n360,0,0\n", "not a finite number"),
        ("x," + ",".join(map(str, range(300, 1400))) + "\n340,0\n", "more than 1000"),
    ],
)
def test_damaged_files_are_refused_in_one_line(text: str, says: str, tmp_path: Path) -> None:
    (tmp_path / "bad.csv").write_text(text, encoding="utf-8")
    with pytest.raises(AssetError) as caught:
        matrix_of(tmp_path / "bad.csv")
    (problem,) = caught.value.problems
    assert problem.startswith(str(tmp_path / "bad.csv"))
    assert says in problem
