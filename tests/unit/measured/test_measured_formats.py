"""Readers of measured reflectance: what they read, and what they refuse in one line."""

from __future__ import annotations

import math
import struct
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glshade.errors import AssetError
from glshade.measured.formats import binary, brdf
from glshade.measured.parametrisations import PARAMETRISATIONS
from glshade.measured.reading import read
from glshade.measured.rusinkiewicz import angles, directions, mirrored, spherical
from glshade.measured.samples import AXES, Grid, Samples, lit_from_x

CORNELL = """# A comment
# num wls
3
# wls
450 550
650
# theta i, phi i, theta s, phi s, values
0.5 0.0 0.3 3.1 0.1 0.1 0.1
0.7 0.0 0.2 -1.0 0.2 0.2 0.2
"""
ALTA = """# A comment
#DIM 3 1
#PARAM_IN ISOTROPIC_TL_TV_PROJ_DPHI
#PARAM_OUT INV_STERADIAN
0.5 0.3 0.0 0.25
0.5 0.0 0.4 0.5
"""


def some_pairs(count: int = 50) -> tuple[np.ndarray, np.ndarray]:
    """Returns unit directions l and v (N, 3) above the horizon, the light from the azimuth 0."""
    chance = np.random.default_rng(7)
    theta, phi = 1.4 * chance.random((2, count)), 6.2 * chance.random((2, count))
    return lit_from_x(spherical(theta[0], phi[0]), spherical(theta[1], phi[1]))


def small_binary(f: np.ndarray) -> bytes:
    return binary.written(f)


def write(folder: Path, name: str, content: str | bytes) -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def test_cornell_greys_are_read_as_their_values(tmp_path: Path) -> None:
    samples = read(write(tmp_path, "a.brdf", CORNELL))
    assert isinstance(samples, Samples)
    assert samples.f == pytest.approx(np.array([[0.1] * 3, [0.2] * 3]), rel=1e-6)
    assert samples.l == pytest.approx(spherical(np.array([0.5, 0.7]), np.zeros(2)))
    assert samples.v == pytest.approx(spherical(np.array([0.3, 0.2]), np.array([3.1, -1.0])))


def test_what_is_written_as_cornell_is_read_back(tmp_path: Path) -> None:
    l, v = some_pairs()
    f = np.random.default_rng(1).random((len(l), 3))
    samples = read(write(tmp_path, "a.brdf", brdf.written(Samples(l, v, f), "test")))
    assert isinstance(samples, Samples)
    assert samples.f == pytest.approx(f, rel=1e-6, abs=1e-7)
    assert samples.l == pytest.approx(l, abs=1e-7)
    assert samples.v == pytest.approx(v, abs=1e-7)


def test_written_spectra_have_no_negative_values_and_whites_are_even() -> None:
    spectra = brdf.primary_spectra()
    assert spectra.min() >= 0
    assert spectra @ brdf.colour_weights(brdf.WRITTEN) == pytest.approx(np.eye(3), abs=1e-8)


def test_what_is_written_as_merl_is_read_back(tmp_path: Path) -> None:
    f = np.random.default_rng(2).random((3, 4, 5, 3))
    f[1, 2, 3] = np.nan
    grid = read(write(tmp_path, "a.binary", small_binary(f)))
    assert isinstance(grid, Grid)
    assert grid.f == pytest.approx(f, nan_ok=True)
    assert len(grid.samples(1000)) == 59


def test_merl_stores_phi_d_fastest_and_scales_each_channel(tmp_path: Path) -> None:
    """The layout, written by hand: index phi_d + P (theta_d + D theta_h), then the planes of red, green and blue."""
    numbers = np.zeros((3, 2, 3, 4))
    numbers[0, 1, 2, 3] = numbers[1, 1, 2, 3] = numbers[2, 1, 2, 3] = 1500.0
    grid = read(write(tmp_path, "a.binary", struct.pack("<3i", 2, 3, 4) + numbers.astype("<f8").tobytes()))
    assert isinstance(grid, Grid)
    assert grid.f.shape == (4, 3, 2, 3)
    assert grid.f[3, 2, 1] == pytest.approx([1.0, 1.15, 1.66])
    assert np.count_nonzero(grid.f) == 3


def test_merl_cells_lie_at_the_middle_of_their_angles() -> None:
    samples = Grid(np.ones((4, 3, 2, 3))).samples(1000)
    theta_h, theta_d, phi_d = samples.about(False)
    assert np.unique(theta_h.round(9)) == pytest.approx(math.pi / 2 * np.array([0.25, 0.75]) ** 2)
    assert np.unique(theta_d.round(9)) == pytest.approx(math.pi / 2 * np.array([1, 3, 5]) / 6)
    assert np.unique((phi_d % (2 * math.pi)).round(9)) == pytest.approx(math.pi * np.array([1, 3, 5, 7]) / 8)


def columns_of(name: str, l: np.ndarray, v: np.ndarray) -> np.ndarray | None:
    """Returns the numbers (N, K) by which ALTA describes l and v, from its definitions; None where they do not say all."""
    theta_l, theta_v = np.arccos(l[:, 2]), np.arccos(v[:, 2])
    phi_l, phi_v = np.arctan2(l[:, 1], l[:, 0]), np.arctan2(v[:, 1], v[:, 0])
    half, back = (l + v) / 2, (l - v) / 2
    # The difference direction of v about h.
    theta_h, theta_d, phi_d = angles(v, l)
    phi_h = np.arctan2(half[:, 1], half[:, 0])
    r = mirrored(l)
    k = (r + v) / np.linalg.norm(r + v, axis=1, keepdims=True)
    theta_k, phi_k = np.arccos(k[:, 2]), np.arctan2(k[:, 1], k[:, 0])
    between = np.arccos(np.clip(np.sum(l * v, axis=1), -1, 1))
    towards = np.stack([-np.cos(theta_l), 0 * theta_l, np.sin(theta_l)], axis=-1)
    turn = np.arctan2(v[:, 1], np.sum(v * towards, axis=1))
    flat_h, flat_b = np.hypot(half[:, 0], half[:, 1]), np.hypot(back[:, 0], back[:, 1])
    phi_b = np.arctan2(back[:, 1], back[:, 0])
    known = {
        "ISOTROPIC_TV_TL_DPHI": (theta_v, theta_l, phi_l - phi_v),
        "ISOTROPIC_TL_TV_PROJ_DPHI": (theta_l, theta_v * np.cos(phi_v), theta_v * np.sin(phi_v)),
        "RUSIN_TH_TD_PD": (theta_h, theta_d, phi_d),
        "RUSIN_TH_PH_TD_PD": (theta_h, phi_h, theta_d, phi_d),
        "SCHLICK_TL_TK_PROJ_DPHI": (theta_l, theta_k * np.cos(phi_k), theta_k * np.sin(phi_k)),
        "RETRO_TL_TVL_PROJ_DPHI": (theta_l, between * np.cos(turn), between * np.sin(turn)),
        "SPHERICAL_TL_PL_TV_PV": (theta_l, phi_l, theta_v, phi_v),
        "STARK_3D": (flat_h, np.linalg.norm(back, axis=1), phi_b - phi_h),
        "NEUMANN_3D": (flat_h, flat_b, phi_b - phi_h + math.pi),
        "STEREOGRAPHIC": (*(v[:, i] / (1 + v[:, 2]) for i in (0, 1)), *(l[:, i] / (1 + l[:, 2]) for i in (0, 1))),
        "CARTESIAN": (*v.T, *l.T),
    }
    return np.stack(known[name], axis=-1) if name in known else None


@pytest.mark.parametrize("name", sorted(PARAMETRISATIONS))
def test_alta_parametrisations_give_the_directions_that_they_describe(name: str) -> None:
    l, v = some_pairs()
    parametrisation = PARAMETRISATIONS[name]
    columns = columns_of(name, l, v)
    if columns is not None:
        assert columns.shape[1] == parametrisation.columns
        found_l, found_v = parametrisation.pair(*columns.T)
        assert np.linalg.norm(found_l, axis=1) == pytest.approx(np.ones(len(l)))
        for retro in (False, True):
            expected, found = Samples(l, v, l).about(retro), Samples(found_l, found_v, l).about(retro)
            assert found[0] == pytest.approx(expected[0], abs=1e-6)
            assert found[1] == pytest.approx(expected[1], abs=1e-6)
            assert np.cos(found[2] - expected[2]) == pytest.approx(np.ones(len(l)), abs=1e-6)
        return
    # The others leave angles out: what they hold is that of a pair of directions above the horizon.
    numbers = {1: [np.array([0.6, 0.9])], 2: [np.array([0.5, 0.3]), np.array([0.2, 0.4])]}
    vectors = [np.array([0.6, 0.0]), np.array([0.0, 0.28]), np.array([0.8, 0.96])]
    found_l, found_v = parametrisation.pair(*(vectors if parametrisation.columns == 3 else numbers[parametrisation.columns]))
    assert np.linalg.norm(found_l, axis=1) == pytest.approx(np.ones(2))
    assert np.linalg.norm(found_v, axis=1) == pytest.approx(np.ones(2))
    assert len(parametrisation.axes) <= parametrisation.columns or parametrisation.axes == AXES


def test_a_cosine_of_the_half_vector_is_read_as_its_angle(tmp_path: Path) -> None:
    text = "#DIM 1 3\n#PARAM_IN COS_TH\n#PARAM_OUT RGB_COLOR\n" + "".join(f"{c} 0.1 0.2 0.3\n" for c in (1, 0.8, 0.5))
    samples = read(write(tmp_path, "a.alta", text))
    assert isinstance(samples, Samples)
    assert samples.axes == ("theta_h",)
    assert samples.retro is False
    assert samples.about(False)[0] == pytest.approx(np.arccos([1, 0.8, 0.5]), abs=1e-7)
    assert samples.f == pytest.approx(np.tile([0.1, 0.2, 0.3], (3, 1)))


def test_a_cosine_in_the_values_is_that_of_the_viewer(tmp_path: Path) -> None:
    text = ALTA.replace("INV_STERADIAN", "INV_STERADIAN_COSINE_FACTOR")
    samples = read(write(tmp_path, "a.dat", text))
    assert isinstance(samples, Samples)
    assert samples.f[:, 0] == pytest.approx([0.25 / math.cos(0.3), 0.5 / math.cos(0.4)])


def test_samples_at_the_horizon_are_left_out_and_counted(tmp_path: Path) -> None:
    samples = read(write(tmp_path, "a.dat", ALTA + f"0.5 {math.pi / 2} 0 0.1\n"))
    assert isinstance(samples, Samples)
    assert len(samples) == 2
    assert samples.notes == ("1 samples at or below the horizon are left out",)


REFUSED = {
    "missing wavelengths": ("a.brdf", "# num wls\n3\n450 550\n", "cut short"),
    "an absurd count": ("a.brdf", "# num wls\n2000000000\n450\n", "number of wavelengths"),
    "a count that is not whole": ("a.brdf", "# num wls\n2.5\n450\n", "number of wavelengths"),
    "falling wavelengths": ("a.brdf", CORNELL.replace("450 550", "550 450"), "must rise"),
    "a sample cut short": ("a.brdf", CORNELL[:-5], "cut short"),
    "no samples": ("a.brdf", CORNELL.partition("0.5 0.0")[0], "holds no samples"),
    "NaN": ("a.brdf", CORNELL.replace("0.1 0.1 0.1", "0.1 nan 0.1"), '"nan" is not a finite number'),
    "words": ("a.brdf", CORNELL.replace("0.1 0.1 0.1", "0.1 x 0.1"), '"x" is not a finite number'),
    "negative samples": ("a.brdf", CORNELL.replace("0.2 0.2 0.2", "0.2 -0.2 0.2"), ":9: a value is negative"),
    "degrees": ("a.brdf", CORNELL.replace("0.7 0.0", "70 0.0"), ":9: an angle from the normal"),
    "all black": ("a.brdf", CORNELL.replace("0.1 0.1 0.1", "0 0 0").replace("0.2 0.2 0.2", "0 0 0"), "holds no light"),
    "a huge value": ("a.brdf", CORNELL.replace("0.2 0.2 0.2", "1e200 1 1"), "which no surface has"),
    "no dimensions": ("a.alta", "#PARAM_IN COS_TH\n1 2\n", "#DIM 3 1"),
    "absurd dimensions": ("a.alta", ALTA.replace("#DIM 3 1", "#DIM 999999999 1"), "#DIM 3 1"),
    "an unknown parametrisation": ("a.alta", ALTA.replace("ISOTROPIC_TL_TV_PROJ_DPHI", "RUSIN_TH_TD_PHI"), "RUSIN_TH_TD_PD"),
    "dimensions of another one": ("a.alta", ALTA.replace("#DIM 3 1", "#DIM 2 1"), "has 3 inputs, but #DIM says 2"),
    "an unknown quantity": ("a.alta", ALTA.replace("INV_STERADIAN", "ENERGY"), "no reflectance that is known"),
    "a short line": ("a.alta", ALTA + "0.1 0.2\n", ":7: a sample has 4 numbers"),
    "a negative value": ("a.alta", ALTA + "0.5 0.3 0.1 -1\n", ":7: a value is negative"),
    "infinity": ("a.alta", ALTA + "0.5 0.3 0.1 inf\n", '"inf" is not a finite number'),
    "impossible directions": (
        "a.alta",
        "#DIM 1 1\n#PARAM_IN COS_TH\n#PARAM_OUT INV_STERADIAN\n0.5 1\n1.5 1\n",
        ":5: these numbers describe no pair",
    ),
    "a zero byte": ("a.alta", ALTA + "\0", "is not a text file"),
    "RGL": ("a.bsdf", b"tensor_file\0" + bytes(40), "RGL material database"),
    "RGL by another name": ("a.dat", b"tensor_file\0" + bytes(40), "RGL material database"),
    "an empty MERL file": ("a.binary", b"", "cut short"),
    "MERL cut short": ("a.binary", small_binary(np.ones((2, 2, 2, 3)))[:-8], "cut short"),
    "absurd MERL counts": ("a.binary", struct.pack("<3i", 90, 90, 2**31 - 1) + bytes(64), "numbers of cells"),
    "negative MERL counts": ("a.binary", struct.pack("<3i", -90, 90, 180) + bytes(64), "numbers of cells"),
    "NaN in MERL": ("a.binary", struct.pack("<3i3d", 1, 1, 1, 1.0, math.nan, 1.0), "number 2 after the header"),
    "MERL without a cell": ("a.binary", small_binary(np.full((2, 2, 2, 3), np.nan)), "holds no samples"),
    "another format": ("a.png", b"\x89PNG\r\n\x1a\n" + bytes(64), "no known format"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_bad_files_are_refused_in_one_line(name: str, tmp_path: Path) -> None:
    file, content, words = REFUSED[name]
    path = write(tmp_path, file, content)
    with pytest.raises(AssetError) as caught:
        read(path)
    message = str(caught.value)
    assert message.startswith(str(path))
    assert words in message
    assert "\n" not in message


def test_a_long_line_is_refused_before_it_is_taken_apart(tmp_path: Path) -> None:
    path = tmp_path / "long.alta"
    path.write_text("#DIM 1 1\n#PARAM_IN COS_TH\n#PARAM_OUT INV_STERADIAN\n" + "0.5 " * 300_000, encoding="utf-8")
    with pytest.raises(AssetError, match=r"long.alta:4: has 1,200,000 bytes, more than the 1,048,576 of a line"):
        read(path)


@pytest.mark.parametrize(("name", "text"), [("many.alta", ALTA), ("many.brdf", CORNELL)])
def test_more_samples_than_a_table_can_be_made_of_are_refused(
    name: str, text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    monkeypatch.setattr("glshade.measured.number_lines.MOST_SAMPLES", 2)
    assert len(read(path).f) == 2
    monkeypatch.setattr("glshade.measured.number_lines.MOST_SAMPLES", 1)
    with pytest.raises(AssetError, match=rf"{name}:\d+: holds more than 1 samples"):
        read(path)


def test_a_file_as_large_as_those_of_merl_takes_little_memory_beside_its_values() -> None:
    """The values take 35 MB as float64, and so does the file itself."""
    data = binary.MERL_HEADER + bytes(8 * 3 * 90 * 90 * 180)
    tracemalloc.start()
    try:
        with pytest.raises(AssetError, match="holds no light"):
            read(Path("black.binary"), data)
        assert tracemalloc.get_traced_memory()[1] < 60e6
    finally:
        tracemalloc.stop()


def test_a_missing_file_and_a_folder_are_refused(tmp_path: Path) -> None:
    with pytest.raises(AssetError, match=r"none\.brdf: there is no such file"):
        read(tmp_path / "none.brdf")
    with pytest.raises(AssetError, match="cannot be read: Is a directory"):
        read(tmp_path)


@given(st.integers(0, len(CORNELL) - 1), st.sampled_from(["", "x", "-", "1e999", "\n", "nan"]))
def test_a_changed_character_is_read_or_refused_with_the_path(place: int, other: str) -> None:
    from glshade.measured.formats import MeasuredFile

    data = (CORNELL[:place] + other + CORNELL[place + 1 :]).encode()
    message = ""
    try:
        samples = brdf.Brdf().read(MeasuredFile(Path("a.brdf"), data))
    except AssetError as error:
        message = str(error)
    assert message.startswith("a.brdf:") if message else np.isfinite(samples.f).all()


@given(st.floats(0.01, 1.5), st.floats(0.01, 1.5), st.floats(-math.pi, math.pi))
def test_angles_and_directions_are_each_other_s_inverse(theta_h: float, theta_d: float, phi_d: float) -> None:
    l, v = directions(*(np.array([angle]) for angle in (theta_h, theta_d, phi_d)))
    found = angles(l, v)
    assert found[0][0] == pytest.approx(theta_h, abs=1e-9)
    assert found[1][0] == pytest.approx(theta_d, abs=1e-9)
    assert math.cos(found[2][0] - phi_d) == pytest.approx(1, abs=1e-9)


def test_exchanging_the_directions_turns_phi_d_by_half_a_turn() -> None:
    l, v = some_pairs()
    forth, back = angles(l, v), angles(v, l)
    assert forth[0] == pytest.approx(back[0])
    assert np.cos(forth[2] - back[2]) == pytest.approx(-np.ones(len(l)))
