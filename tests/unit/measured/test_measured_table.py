"""The table of measured reflectance: its grid, its errors, and what it holds where nothing was measured."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glshade.brdfs import BRDFS
from glshade.catalogue.baking import baked_grid, baked_samples, reflectance
from glshade.catalogue.fit_errors import relative_errors
from glshade.errors import AssetError
from glshade.measured import file, tabulation
from glshade.measured.formats import binary, brdf
from glshade.measured.reading import read
from glshade.measured.rusinkiewicz import directions, spherical
from glshade.measured.samples import Grid, Samples, lit_from_x
from glshade.measured.scattered import Scattered, without_dropouts
from glshade.measured.table import BRIGHTEST, DARKEST, above_horizon, coordinates, of_function
from glshade.measured.tabulation import is_grained, tabulated


def pairs(count: int, seed: int = 3, steepest: float = 1.45) -> tuple[np.ndarray, np.ndarray]:
    """Returns unit directions l and v (N, 3) within an angle from the normal [rad], the light from the azimuth 0."""
    chance = np.random.default_rng(seed)
    theta, phi = steepest * chance.random((2, count)), 2 * math.pi * chance.random((2, count))
    return lit_from_x(spherical(theta[0], phi[0]), spherical(theta[1], phi[1]))


def cells(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns unit directions l and v (N, 3), even over the cells of the table, which are dense about h = n."""
    u = np.random.default_rng(4).random((3, count))
    angles = math.pi / 2 * u[0] ** 2, math.pi / 2 * u[1], math.pi * u[2]
    above = above_horizon(*angles)
    return directions(*(angle[above] for angle in angles))


def smooth(l: Any, v: Any) -> Any:
    """A paint: a wide lobe about h = n over a coloured base, [1/sr]."""
    h = l + v
    h = h / np.linalg.norm(h, axis=-1, keepdims=True)
    lobe = np.exp(-(1 - h[..., 2]) / 0.05)
    return np.array([0.02, 0.05, 0.2]) + lobe[..., None]


@pytest.mark.parametrize(("name", "values"), [("ggx", {"roughness": 0.316}), ("ward", {"alpha_x": 0.1})])
def test_a_baked_table_is_right_within_a_percent(name: str, values: dict[str, float]) -> None:
    material = BRDFS[name].model_validate({"brdf": name, **values})
    # A third of the cells along phi_d, which matters least, makes the test quick.
    table = tabulated(baked_grid(material, (60, 90, 90)))
    l, v = cells(5000)
    errors = relative_errors(table.at(l, v), Samples(l, v, reflectance(material, l, v)))
    assert np.quantile(errors, 0.95) < 0.01


def test_the_table_s_axes_are_theta_h_theta_d_and_phi_d() -> None:
    """A mirrored phi_d or exchanged axes give another value."""

    def f(l: Any, v: Any) -> Any:
        q, h = l - v, l + v
        h = h / np.linalg.norm(h, axis=-1, keepdims=True)
        phi_d = np.arctan2(h[..., 0] * q[..., 1] - h[..., 1] * q[..., 0], -q[..., 2])
        theta_d = np.arcsin(np.linalg.norm(q, axis=-1) / 2)
        return np.exp2(np.stack([np.sin(phi_d), 2 * theta_d, 3 * h[..., 2]], axis=-1))

    table = of_function(f, 2 * math.pi, (36, 16, 24))
    assert table.values.shape == (36, 16, 24, 3)
    l, v = directions(np.array([0.4]), np.array([0.5]), np.array([1.0]))
    assert np.log2(table.at(l, v)[0]) == pytest.approx([math.sin(1.0), 1.0, 3 * math.cos(0.4)], abs=0.02)
    assert np.log2(table.at(v, l)[0, 0]) == pytest.approx(-math.sin(1.0), abs=0.02)


def test_where_phi_d_means_nothing_the_table_does_not_depend_on_it() -> None:
    chance = np.random.default_rng(0)
    values = tabulated(Grid(chance.random((6, 5, 4, 3)))).values
    assert np.all(values[:, 0] == values[:1, 0])
    assert np.all(values[:, :, 0] == values[:1, :, 0])
    assert np.any(values[:, 2, 2] != values[:1, 2, 2])


def test_cells_below_the_horizon_continue_and_are_never_black() -> None:
    table = of_function(lambda l, v: np.full(l.shape, 0.25), size=(12, 10, 10))
    assert np.all(table.values == -2)
    # Cells that a file leaves out inside of what was measured are filled, too.
    f = np.full((6, 5, 4, 3), 0.5)
    f[3, 2, 1] = np.nan
    f[:, 4] = np.nan
    assert np.all(tabulated(Grid(f)).values == -1)


def test_black_and_overbright_values_stay_within_half_floats() -> None:
    table = tabulated(Grid(np.stack([np.zeros((4, 4, 4)), np.full((4, 4, 4), 1e9), np.full((4, 4, 4), 1e-30)], axis=-1)))
    assert np.isfinite(table.values).all()
    assert table.values[..., 1].max() == BRIGHTEST
    assert table.values.min() >= DARKEST


def test_a_table_of_scattered_samples_goes_through_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tabulation, "SCATTERED_SIZE", (36, 36, 36))
    l, v = pairs(500)
    samples = Samples(l, v, smooth(l, v))
    table = tabulated(samples)
    assert not table.retro
    assert table.turn == 2 * math.pi
    errors = relative_errors(table.at(l, v), samples)
    assert np.median(errors) < 0.02
    # Between the samples it is better than the nearest of them.
    other_l, other_v = pairs(400, seed=9, steepest=1.3)
    true = Samples(other_l, other_v, smooth(other_l, other_v))
    distance = np.linalg.norm(other_l[:, None] - l, axis=-1) + np.linalg.norm(other_v[:, None] - v, axis=-1)
    nearest = samples.f[np.argmin(distance, axis=1)]
    ours, theirs = (np.median(relative_errors(f, true)) for f in (table.at(other_l, other_v), nearest))
    assert ours < 0.5 * theirs


def test_past_the_measured_angles_the_last_one_holds() -> None:
    l, v = pairs(400, steepest=1.0)
    scattered = Scattered(Samples(l, v, smooth(l, v)))

    def at(theta: float) -> np.ndarray:
        """f where light and viewer make an angle with the normal, and their azimuths differ by 2."""
        light, viewer = spherical(np.full(1, theta), np.zeros(1)), spherical(np.full(1, theta), np.full(1, 2.0))
        return scattered.at(*Samples(light, viewer, l[:1]).about(scattered.retro))

    last = min(scattered.largest)
    assert at(1.5) == pytest.approx(at(last), rel=1e-6)
    assert at(1.5) != pytest.approx(at(last - 0.3), rel=1e-3)


def test_retroreflecting_data_are_tabulated_about_the_back_vector() -> None:
    l, v = pairs(800, steepest=1.2)
    peak = np.exp(-(1 - np.sum(l * v, axis=1)) / 0.01)
    # Half of the samples lie near the peak, as in measurements of such surfaces.
    v[::2] = l[::2] + 0.1 * np.random.default_rng(5).normal(size=(400, 3))
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    peak = np.exp(-(1 - np.sum(l * v, axis=1)) / 0.01)
    f = np.repeat(0.1 + 10 * peak[:, None], 3, axis=1)
    assert Scattered(Samples(l, v, f)).retro
    assert not Scattered(Samples(*pairs(800), smooth(*pairs(800)))).retro


def test_data_that_vary_theta_h_alone_make_a_table_of_one_row() -> None:
    theta = np.linspace(0, 1.3, 30)
    l, v = directions(theta, np.zeros(30), np.zeros(30))
    f = np.repeat(np.exp(-theta)[:, None], 3, axis=1)
    table = tabulated(Samples(l, v, f, ("theta_h",), False))
    assert table.values.shape == (1, 1, 180, 3)
    other_l, other_v = directions(np.array([0.5]), np.array([0.6]), np.array([1.0]))
    assert table.at(other_l, other_v)[0] == pytest.approx(np.full(3, math.exp(-0.5)), rel=0.01)
    assert "theta_h" in table.notes[-1]


@pytest.fixture
def small_tables(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tables of few cells, which are quick to make."""
    monkeypatch.setattr(tabulation, "SCATTERED_SIZE", (12, 12, 10))
    monkeypatch.setattr(tabulation, "DENSE", 12)


@pytest.mark.usefixtures("small_tables")
def test_reciprocity_is_kept_or_enforced() -> None:
    l, v = pairs(300)
    f = np.repeat((0.2 + 0.5 * l[:, 2:] ** 2), 3, axis=1)
    kept, enforced = (tabulated(Samples(l, v, f), reciprocity) for reciprocity in ("kept", "enforced"))  # type: ignore[arg-type]
    a, b = spherical(np.array([0.2]), np.zeros(1)), spherical(np.array([1.0]), np.ones(1))
    assert kept.at(a, b)[0, 0] > 1.2 * kept.at(b, a)[0, 0]
    assert enforced.turn == math.pi
    assert enforced.at(a, b)[0] == pytest.approx(enforced.at(b, a)[0], rel=1e-6)
    assert kept.at(b, a)[0, 0] < enforced.at(a, b)[0, 0] < kept.at(a, b)[0, 0]


def test_dropouts_are_left_out_and_counted() -> None:
    l, v = pairs(300)
    f = np.full((300, 3), 0.5)
    f[100] = 0.01
    kept = without_dropouts(Samples(l, v, f))
    assert len(kept) == 299
    assert "1 samples" in kept.notes[-1]
    assert without_dropouts(Samples(l, v, smooth(l, v))).notes == ()


def test_a_surface_with_a_grain_is_told_from_one_without() -> None:
    def grained(values: dict[str, float]) -> bool:
        return is_grained(baked_samples(BRDFS["ward"].model_validate({"brdf": "ward", **values})))

    assert grained({"alpha_x": 0.3, "alpha_y": 0.1})
    l, v = pairs(300)
    turn = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    both = Samples(np.concatenate([l, l @ turn]), np.concatenate([v, v @ turn]), np.tile(smooth(l, v), (2, 1)))
    assert both.oriented
    assert not is_grained(both)


@pytest.mark.usefixtures("small_tables")
def test_a_table_is_made_once_for_each_content_and_setting(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    l, v = pairs(60)
    path = tmp_path / "a.brdf"
    path.write_text(brdf.written(Samples(l, v, smooth(l, v)), "test"), encoding="utf-8")
    first = file.load(path)
    file._kept.cache_clear()
    monkeypatch.setattr(file, "tabulated", None)
    again = file.load(path)
    assert np.array_equal(first.values, again.values)
    assert (first.turn, first.retro, first.digest, first.notes) == (again.turn, again.retro, again.digest, again.notes)
    # A damaged entry of the cache is made again.
    entry = file._entry(first.digest)
    entry.write_bytes(entry.read_bytes()[:-1])
    file._kept.cache_clear()
    monkeypatch.setattr(file, "tabulated", tabulated)
    assert np.array_equal(file.load(path).values, first.values)
    assert file.load(path, "enforced").digest != first.digest


def test_data_of_a_surface_with_a_grain_are_not_drawn(tmp_path: Path) -> None:
    material = BRDFS["ward"].model_validate({"brdf": "ward", "alpha_x": 0.3, "alpha_y": 0.1})
    path = tmp_path / "brushed.brdf"
    path.write_text(brdf.written(baked_samples(material), "test"), encoding="utf-8")
    with pytest.raises(AssetError, match="glshade fit"):
        file.load(path)


def test_a_file_of_cells_is_drawn_as_it_is(tmp_path: Path) -> None:
    f = 0.1 + np.random.default_rng(0).random((6, 5, 4, 3))
    path = tmp_path / "a.binary"
    path.write_bytes(binary.written(f))
    table = file.load(path)
    theta = math.pi / 2 * (2.5 / 4) ** 2, math.pi / 2 * 2.5 / 5, math.pi * 3.5 / 6
    at = coordinates(*(np.array([angle]) for angle in theta), table.turn)
    assert np.exp2(table.volume().sample(at))[0] == pytest.approx(f[3, 2, 2], rel=0.01)


DATA = Path(__file__).resolve().parents[4] / "shared" / "data" / "measured"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["krylon_blue.brdf", "pink-felt-1d.alta"])
def test_real_data_are_drawn_within_2_percent_at_the_median(name: str) -> None:
    if not (DATA / name).is_file():
        pytest.skip(f"{name} is not in ../shared/data/measured")
    samples = read(DATA / name)
    assert isinstance(samples, Samples)
    table = tabulated(samples)
    assert np.nanmedian(relative_errors(table.at(samples.l, samples.v), samples)) < 0.02
    assert table.values.nbytes < 20e6
