"""Fits: baked parameters come back, and what the samples do not determine is said."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glshade.brdfs import BRDFS, Brdf
from glshade.catalogue.baking import baked_grid, baked_samples, reflectance
from glshade.catalogue.fit_errors import errors_by_angle, of_material, relative_errors
from glshade.catalogue.fitting import METRICS, fit_model, transformed
from glshade.measured.reading import read
from glshade.measured.rusinkiewicz import directions
from glshade.measured.samples import Samples, points

# A coarse grid of cells: a fit looks at 1500 of them at most.
SIZE = (24, 30, 30)


def material_of(name: str, values: dict[str, Any]) -> Brdf:
    return BRDFS[name].model_validate({"brdf": name, **values})


def same(found: Brdf, baked: Brdf, names: Any, within: float = 0.01) -> None:
    for name in names:
        assert getattr(found, name) == pytest.approx(getattr(baked, name), rel=within, abs=1e-4), name


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("ward", {"kd": (0.2, 0.3, 0.1), "ks": (0.1, 0.2, 0.3), "alpha_x": 0.3}),
        ("blinn_phong", {"kd": (0.2, 0.3, 0.1), "ks": (0.4, 0.2, 0.3), "exponent": 40.0}),
        ("ggx", {"kd": (0.2, 0.3, 0.1), "f0": (0.1, 0.2, 0.05), "roughness": 0.5}),
    ],
)
def test_baked_parameters_come_back(name: str, values: dict[str, Any]) -> None:
    baked = material_of(name, values)
    fit = fit_model(baked_grid(baked, SIZE), type(baked))
    same(fit.material, baked, values)
    assert fit.error < 1e-6


def test_a_stretched_lobe_comes_back() -> None:
    baked = material_of("ward", {"alpha_x": 0.3, "alpha_y": 0.12, "kd": (0.3, 0.2, 0.1)})
    fit = fit_model(baked_samples(baked), type(baked))
    same(fit.material, baked, ("alpha_x", "alpha_y", "kd", "ks"))


def test_what_the_samples_do_not_tell_keeps_its_default_and_is_said() -> None:
    fit = fit_model(baked_grid(material_of("blinn_phong", {}), SIZE), BRDFS["blinn_phong"])
    assert fit.material.ka is None  # type: ignore[attr-defined]
    assert "light from a direction" in fit.held["ka"]
    ggx = fit_model(baked_grid(material_of("ggx", {}), SIZE), BRDFS["ggx"])
    assert "stand in" in ggx.held["metallic"]
    assert ggx.material.metallic == 0  # type: ignore[attr-defined]


def test_fixed_parameters_are_kept() -> None:
    baked = material_of("ggx", {"metallic": 1.0, "kd": (0.9, 0.6, 0.3), "roughness": 0.4})
    fit = fit_model(baked_grid(baked, SIZE), BRDFS["ggx"], fixed={"metallic": 1.0})
    same(fit.material, baked, ("kd", "roughness", "metallic"))
    assert "f0" in fit.held


def test_a_start_frees_a_part_that_is_off_by_default() -> None:
    baked = material_of("lafortune", {"ks_2": (0.2, 0.1, 0.1), "cx_2": 1.0, "exponent_2": 8.0, "exponent_1": 40.0})
    names = ("cx_1", "cz_1", "cx_2", "cz_2")
    fixed = {name: getattr(baked, name) for name in names}
    fit = fit_model(baked_grid(baked, SIZE), BRDFS["lafortune"], fixed=fixed, start={"ks_2": (0.1, 0.1, 0.1)})
    same(fit.material, baked, ("ks_1", "ks_2", "exponent_1", "exponent_2", "kd"))


def test_a_model_without_free_parameters_is_refused() -> None:
    with pytest.raises(ValueError, match="no parameter that is free"):
        fit_model(baked_grid(material_of("lambert", {}), SIZE), BRDFS["lambert"], fixed={"kd": (0.5, 0.5, 0.5)})


def test_both_metrics_find_the_least_of_their_own_error() -> None:
    measured = baked_grid(material_of("metal", {}), SIZE)
    samples = measured.samples(1500)
    fits = {metric: fit_model(measured, BRDFS["ward"], metric).material for metric in ("log-cosine", "cosine")}  # type: ignore[arg-type]

    def error(material: Brdf, metric: Any) -> float:
        l, v = samples.l, samples.v
        off = transformed(reflectance(material, l, v) * l[:, 2:], metric) - transformed(samples.f * l[:, 2:], metric)
        return float(np.sqrt(np.mean(off**2)))

    assert error(fits["log-cosine"], "log-cosine") < error(fits["cosine"], "log-cosine")
    assert error(fits["cosine"], "cosine") < error(fits["log-cosine"], "cosine")


def test_errors_are_told_by_the_angle_of_the_light() -> None:
    theta = np.radians([10.0, 20.0, 20.0, 50.0])
    l, v = directions(theta, np.zeros(4), np.zeros(4))
    samples = Samples(l, v, np.full((4, 3), 0.5))
    rows = errors_by_angle(samples, {"half": lambda l, v: np.full(l.shape, 0.25), "right": lambda l, v: np.full(l.shape, 0.5)})
    assert [(row.low, row.high, row.count) for row in rows] == [(0, 15, 1), (15, 30, 2), (45, 60, 1)]
    assert all(row.medians == {"half": 0.5, "right": 0.0} for row in rows)
    assert relative_errors(np.zeros((4, 3)), samples) == pytest.approx(np.ones(4))


def test_a_fitted_material_s_errors_are_those_of_its_values() -> None:
    baked = material_of("lambert", {"kd": (0.3, 0.3, 0.3)})
    grid = baked_grid(baked, (6, 6, 6))
    rows = errors_by_angle(grid.samples(1000), {"same": of_material(baked)})
    assert rows
    assert all(row.medians["same"] < 1e-9 for row in rows)


# The models whose baked parameters a fit has to recover, with random parameters.
def random_values(name: str, chance: np.random.Generator) -> dict[str, Any]:
    kd, ks = (tuple(0.05 + 0.45 * chance.random(3)) for _ in range(2))
    alpha = 0.1 + 0.5 * chance.random()
    exponent = 2 / alpha**2 - 2 + 2
    return {
        "ward": {"kd": kd, "ks": ks, "alpha_x": alpha},
        "ward_duer": {"kd": kd, "ks": ks, "alpha_x": alpha},
        "blinn_phong": {"kd": kd, "ks": ks, "exponent": exponent},
        "beckmann": {
            "kd": kd,
            "roughness": math.sqrt(alpha),
            "eta": tuple(1.2 + chance.random(3)),
            "k": tuple(2 * chance.random(3)),
        },
        "ashikhmin_shirley": {"kd": kd, "ks": ks, "pu": exponent, "pv": exponent},
        "lafortune": {"kd": kd, "ks_1": ks, "cz_1": 0.7 + 0.3 * chance.random(), "exponent_1": exponent},
        "ggx": {"kd": kd, "f0": ks, "roughness": math.sqrt(alpha)},
    }[name]


RECOVERED = ("ward", "ward_duer", "blinn_phong", "beckmann", "ashikhmin_shirley", "lafortune", "ggx")


@pytest.mark.slow
@pytest.mark.parametrize("name", RECOVERED)
def test_random_isotropic_parameters_come_back(name: str) -> None:
    chance = np.random.default_rng(11)
    for _ in range(1 if name in ("lafortune", "beckmann") else 2):
        values = random_values(name, chance)
        baked = material_of(name, values)
        same(fit_model(baked_grid(baked, SIZE), type(baked)).material, baked, values)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "first", "second"),
    [("ward", "alpha_x", "alpha_y"), ("ward_duer", "alpha_x", "alpha_y"), ("ashikhmin_shirley", "pu", "pv"), ("ggx", "", "")],
)
def test_random_anisotropic_parameters_come_back(name: str, first: str, second: str) -> None:
    chance = np.random.default_rng(12)
    values = random_values(name, chance)
    if first:
        values[second] = values[first] * (0.4 if name != "ashikhmin_shirley" else 4.0)
    else:
        values["anisotropy"] = 0.7
    baked = material_of(name, values)
    same(fit_model(baked_samples(baked), type(baked)).material, baked, values)


@pytest.mark.slow
def test_a_direction_s_largest_factor_is_1() -> None:
    """ks and the length of (cx, cy, cz) stand in for each other, so that only their ratio can be told."""
    baked = material_of("lafortune", {"cx_1": -0.7, "cy_1": -1.0, "cz_1": 0.8, "ks_1": (0.3, 0.2, 0.4), "exponent_1": 25.0})
    fit = fit_model(baked_samples(baked), type(baked))
    same(fit.material, baked, ("cx_1", "cy_1", "cz_1", "ks_1", "exponent_1"))


def test_pink_felt_is_fitted_better_than_in_print() -> None:
    """Ngan et al. (2005) fitted Ward's model to the felt of the MERL database, from which the file's values are."""
    path = Path(__file__).resolve().parents[4] / "shared" / "data" / "measured" / "pink-felt-1d.alta"
    if not path.is_file():
        pytest.skip("pink-felt-1d.alta is not in ../shared/data/measured")
    samples = points(read(path), 1000)
    printed = material_of("ward", {"kd": (0.281, 0.170, 0.112), "ks": (0.083, 0.0623, 0.0318), "alpha_x": 0.5})
    for metric in METRICS:
        fitted = fit_model(samples, BRDFS["ward"], metric).material
        target = transformed(samples.f * samples.l[:, 2:], metric)
        ours, theirs = (
            np.mean((transformed(reflectance(m, samples.l, samples.v) * samples.l[:, 2:], metric) - target) ** 2)
            for m in (fitted, printed)
        )
        assert ours < 0.5 * theirs
