"""Tests the float64 Fresnel functions against textbook formulas, and the GLSL ones against the float64 ones."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.glsl import called

from glshade import BRDFS, Renderer
from glshade.optics.fresnel import f0_conductor, f_conductor, f_dielectric, f_schlick, t0_conductor, t_conductor, t_schlick

COS = np.concatenate([[1e-30, 1e-7, 1e-4], np.linspace(1e-3, 1, 200)])
# (eta, k): indices near 1 and far from it, and some of the preset metals.
INDICES = [(1.5, 0.0), (1.0, 0.0), (1.00001, 0.0), (2.4, 0.0), (0.1239, 4.834), (1.541, 1.676), (3.519, 4.351), (1.02, 0.3)]
# (eta, k) at the ends of the parameters' ranges.
EXTREME = [(0.01, 0.0), (0.01, 1e-4), (100.0, 100.0), (100.0, 0.0), (0.05, 0.99), (0.7, 0.0)]


def three(x: float) -> Any:
    return np.full(3, np.float32(x), dtype=np.float64)


@pytest.mark.parametrize("eta", [1.0001, 1.33, 1.5, 2.5])
def test_dielectric_is_snell_and_fresnel(eta: float) -> None:
    cos = COS[3:-1]  # at 1 the sines are 0
    outside = np.arccos(cos)
    inside = np.arcsin(np.sin(outside) / eta)
    rs = np.sin(outside - inside) / np.sin(outside + inside)
    rp = np.tan(outside - inside) / np.tan(outside + inside)
    expected = 0.5 * (rs**2 + rp**2)
    np.testing.assert_allclose(f_dielectric(cos, eta), expected, rtol=1e-9, atol=1e-12)
    assert f_dielectric(np.array(1.0), eta) == pytest.approx(((eta - 1) / (eta + 1)) ** 2, rel=1e-12)
    assert f_dielectric(np.array(0.0), eta) == pytest.approx(1, rel=1e-15)


def test_brewster() -> None:
    """At Brewster's angle, whose tangent is eta, only one polarisation is reflected."""
    eta = 1.5
    c = np.cos(np.arctan(eta))
    assert f_dielectric(c, eta) == pytest.approx(0.5 * ((eta**2 - 1) / (eta**2 + 1)) ** 2, rel=1e-12)


def test_near_index_one_every_digit_is_kept() -> None:
    """To first order one amplitude is (eta - 1)/(2 c^2), and the other is that times the cosine of twice the angle."""
    step = 2.0**-40
    c = np.linspace(0.1, 1, 50)
    expected = 0.5 * (step / (2 * c * c)) ** 2 * (1 + (2 * c * c - 1) ** 2)
    np.testing.assert_allclose(f_dielectric(c, 1 + step), expected, rtol=1e-9)
    assert np.all(f_dielectric(COS, 1.0) == 0)


@pytest.mark.parametrize(("eta", "k"), INDICES + EXTREME)
def test_conductor_is_its_closed_form(eta: float, k: float) -> None:
    """The textbook form in real numbers, which loses some digits to cancellation."""
    eta, k = float(np.float32(eta)), float(np.float32(k))
    c2, s2 = COS**2, 1 - COS**2
    t0 = eta**2 - k**2 - s2
    sum2 = np.sqrt(t0**2 + 4 * eta**2 * k**2)
    t2 = 2 * COS * np.sqrt(np.maximum(0.5 * (sum2 + t0), 0))
    with np.errstate(divide="ignore", invalid="ignore"):
        rs = (sum2 + c2 - t2) / (sum2 + c2 + t2)
        rp = rs * (c2 * sum2 + s2**2 - t2 * s2) / (c2 * sum2 + s2**2 + t2 * s2)
        expected = np.where((eta == 1) & (k == 0), 0, 0.5 * (rs + rp))
    found = f_conductor(three(eta), three(k), COS)
    np.testing.assert_allclose(found[3:, 0], expected[3:], atol=2e-6)
    np.testing.assert_allclose(found, 1 - t_conductor(three(eta), three(k), COS), atol=1e-14)
    if k == 0 and eta >= 1:
        np.testing.assert_allclose(found[:, 0], f_dielectric(COS, eta), rtol=1e-7, atol=1e-15)
    assert f_conductor(three(eta), three(k), np.array(1.0))[0] == pytest.approx(
        f0_conductor(three(eta), three(k))[0], rel=1e-12
    )
    assert np.all(t_conductor(three(eta), three(k), COS) >= 0)


def test_what_passes() -> None:
    f0 = np.array([0.04, 0.5, 1.0])
    np.testing.assert_allclose(t_schlick(1 - f0, COS), 1 - f_schlick(f0, COS), atol=1e-15)
    assert np.all(t_schlick(1 - f0, COS) >= 0)
    eta, k = np.array([1.5, 0.2, 3.0]), np.array([0.0, 4.0, 4.0])
    np.testing.assert_allclose(t0_conductor(eta, k), 1 - f0_conductor(eta, k), rtol=1e-13)


def test_how_far_off_schlick_is() -> None:
    """The figures are those in the descriptions of the option `fresnel`."""
    # Glass, and chromium in green and in red.
    eta, k = np.array([1.5, 2.859, 3.519]), np.array([0.0, 4.22, 4.351])
    c = np.linspace(0, 1, 2001)
    off = np.abs(f_schlick(f0_conductor(eta, k), c) - f_conductor(eta, k, c)).max(axis=0)
    assert off[0] == pytest.approx(0.036, abs=5e-4)
    assert off[1:].max() == pytest.approx(0.23, abs=5e-3)


@pytest.mark.parametrize("model", ["metal", "beckmann"])
def test_how_far_off_schlick_is_within_the_usual_ranges(model: str) -> None:
    """The figure is that in the descriptions of the option `fresnel`."""
    ranges = [BRDFS[model].parameters()[name].usual for name in ("eta", "k")]
    eta, k = (values.reshape(-1) for values in np.meshgrid(*(np.linspace(*usual, 60) for usual in ranges)))
    c = np.linspace(0, 1, 201)
    off = np.abs(f_schlick(f0_conductor(eta, k), c) - f_conductor(eta, k, c)).max()
    assert off == pytest.approx(0.255, abs=5e-4)


CALLS = {
    "f_conductor": ("optics/f_conductor.glsl", "f_conductor(v.xxx, v.yyy, l.x)", f_conductor),
    "t_conductor": ("optics/t_conductor.glsl", "t_conductor(v.xxx, v.yyy, l.x)", t_conductor),
}


@pytest.mark.parametrize("name", CALLS)
@pytest.mark.parametrize(("eta", "k"), INDICES + EXTREME)
def test_conductor_in_glsl(name: str, eta: float, k: float, renderer: Renderer) -> None:
    file, call, expected = CALLS[name]
    text = f'#include "{file}"\nvec3 value(vec3 l, vec3 v) {{ return {call}; }}\n'
    c = COS.astype(np.float32)
    gpu = called(text, renderer, np.stack([c] * 3, axis=1), np.float32([[eta, k, 0]]))

    def f(c: Any) -> Any:
        return expected(three(eta), three(k), c)[:, 0]

    exact = f(c.astype(np.float64))
    # The change of the value by one rounding of the cosine, and by about three roundings of the value itself.
    moved = np.abs(f(c * (1 + 2.0**-23)) - exact) + 2.0**-22 * exact
    # Below 1e-19 the square of a cosine is 0 in float32. At index 1 the function then gives the value in the horizon.
    chosen = c > 1e-19
    assert np.all(np.abs(gpu[:, 0] - exact)[chosen] <= 2 * moved[chosen] + 1e-14)
    assert np.all(np.isfinite(gpu))
    assert gpu.min() >= 0


@pytest.mark.parametrize("eta", [1.0, 1 + 2.0**-20, 1.001, 1.5, 4.0])
def test_dielectric_in_glsl(eta: float, renderer: Renderer) -> None:
    text = '#include "optics/f_dielectric.glsl"\nvec3 value(vec3 l, vec3 v) { return vec3(f_dielectric(l.x, v.x)); }\n'
    c = COS.astype(np.float32)
    gpu = called(text, renderer, np.stack([c] * 3, axis=1), np.float32([[eta, 0, 0]]))[:, 0]
    exact = f_dielectric(c.astype(np.float64), float(np.float32(eta)))
    # The usual form, (g - c)/(g + c), would be wrong by 10 % at 1 + 2^-20.
    np.testing.assert_allclose(gpu, exact, rtol=2e-6)
