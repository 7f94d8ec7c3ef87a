"""Tests the classical models: their albedos against closed formulas, their constants, and faults of published code."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from glshade import BRDFS, Renderer, evaluate
from glshade.brdfs.ward import GRAZING
from glshade.catalogue.albedo import directional_albedo
from glshade.glsl.generator import slot_code
from glshade.glsl.shaders import expand
from glshade.textures.texture import Texture

Array = NDArray[np.float64]
UP = np.array([0.0, 0.0, 1.0])
WARDS = ["ward", "ward_duer", "ward_gmd"]
NORMALISED = ["phong_normalised", "retro_phong", "blinn_phong_normalised"]
MODELS = [*NORMALISED, *WARDS, "lafortune", "minnaert", "strauss"]


def rule(low: float, high: float, pieces: int = 24) -> tuple[Array, Array]:
    """Gauss-Legendre points and weights, 24 in each piece. The pieces shrink by half towards both ends of the interval, so that
    peaks, roots and poles there are integrated well."""
    x, w = np.polynomial.legendre.leggauss(24)
    steps = np.append(2.0 ** -np.arange(1, pieces), 0.0)
    ends = low + (high - low) * np.concatenate([steps[::-1], 1 - steps[1:]])
    half = np.diff(ends) / 2
    return (ends[:-1, None] + half[:, None] * (x + 1)).ravel(), (half[:, None] * w).ravel()


def at_normal_incidence(model: str, **parameters: Any) -> float:
    """Returns the albedo for v = n, of a model whose value does not depend on the azimuth then."""
    return of_height(model, 1.0, **parameters)


def of_height(model: str, height: float, **parameters: Any) -> float:
    """Returns the albedo for a viewer at n.v = height, of a model whose value does not depend on the azimuth then."""
    u, w = rule(0.0, 1.0)
    r = np.sqrt((1 - u) * (1 + u))
    l = np.stack([0.6 * r, 0.8 * r, u], axis=-1)
    v = np.array([math.sqrt(1 - height * height), 0.0, height])
    brdf = BRDFS[model](**parameters)
    values = {name: np.asarray(value, dtype=np.float64) for name, value in filled_in(brdf).items()}
    value = type(brdf).brdf_cos(type("M", (), values), l, np.broadcast_to(v, l.shape))
    return float(2 * math.pi * np.sum(w * value[:, 0]))


def filled_in(brdf: Any) -> dict[str, Any]:
    values = {name: getattr(brdf, name) for name in brdf.parameters()}
    return {name: getattr(brdf, brdf.parameters()[name].same_as) if x is None else x for name, x in values.items()}


EXPONENTS = [0.0, 0.5, 1.0, 2.0, 7.5, 32.0, 1000.0, 1e5]


@pytest.mark.parametrize("exponent", EXPONENTS)
@pytest.mark.parametrize("model", NORMALISED)
def test_the_albedo_at_normal_incidence_is_kd_and_ks(model: str, exponent: float) -> None:
    assert at_normal_incidence(model, kd=0.3, ks=0.6, exponent=exponent) == pytest.approx(0.9, abs=1e-6)


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_the_lectures_lobes_reflect_more(exponent: float) -> None:
    """The lobes of phong and blinn_phong reflect as much as their `breaks` says."""
    p = exponent
    assert at_normal_incidence("phong", kd=0.0, ks=1.0, exponent=p) == pytest.approx(2 / (p + 1), abs=1e-6)
    blinn = 8 / (p + 2) * (1 - 2 ** -(p / 2 + 1))
    assert at_normal_incidence("blinn_phong", kd=0.0, ks=1.0, exponent=p) == pytest.approx(blinn, abs=1e-6)


def test_the_common_factor_of_blinn_phong_is_too_large() -> None:
    p = np.array(EXPONENTS)
    exact = (p + 2) * (p + 4) / (8 * math.pi * (np.exp2(-p / 2) + p))
    ratio = (p + 8) / (8 * math.pi) / exact
    assert np.all(ratio >= 1 - 1e-12)
    assert 1.07 < ratio.max() < 1.08


@pytest.mark.parametrize("k", [0.0, 0.3, 0.5, 1.0, 1.7, 10.0])
@pytest.mark.parametrize("height", [1e-3, 0.1, 0.5, 1.0])
def test_the_albedo_of_minnaert(k: float, height: float) -> None:
    expected = 0.5 * height ** (k - 1)
    # With k below 1 smaller cosines of the light count as GRAZING, which changes the albedo by about that much.
    assert of_height("minnaert", height, kd=0.5, k=k) == pytest.approx(expected, rel=1e-6 if k else 2e-6)


def test_minnaert_at_its_pole_is_finite_and_reciprocal() -> None:
    """The viewer is as low as n.v = 1e-30, far below 1e-3, the lowest viewer in a picture."""
    v = np.array([[math.sqrt(1 - z * z), 0.0, z] for z in (1e-30, GRAZING / 2, GRAZING, 2 * GRAZING, 1e-3)])
    l = np.array([0.0, 0.6, 0.8])
    found = evaluate(BRDFS["minnaert"](kd=1.0, k=0.0), l, v)[:, 0]
    assert found[0] == found[1] == pytest.approx(1 / (2 * math.pi * GRAZING), rel=1e-6)
    assert found[2:] == pytest.approx(1 / (2 * math.pi * v[2:, 2]), rel=1e-6)
    back = evaluate(BRDFS["minnaert"](kd=1.0, k=0.0), v, l)[:, 0]
    assert back / v[:, 2] == pytest.approx(found / l[2], rel=1e-6)


def test_a_moon_of_minnaert_is_an_even_disc() -> None:
    """With k = 1/2 and the light behind the viewer, all points of a sphere are equally bright."""
    z = np.linspace(0.01, 1, 50)
    d = np.stack([np.sqrt(1 - z * z), 0 * z, z], axis=-1)
    assert np.ptp(evaluate(BRDFS["minnaert"](k=0.5), d, d)[:, 0]) < 1e-6


@pytest.mark.parametrize("alpha", [1.0, 0.5, 0.15, 0.02])
def test_the_albedos_of_wards_at_normal_incidence(alpha: float) -> None:
    """Let t be tan^2 of the half vector's angle. Then dw = 4 cos dw_h, and l is above the horizon for t < 1. The albedo is the
    integral over t of exp(-t/alpha^2) / alpha^2 times sqrt((1 - t)/(1 + t)) / (1 + t)^2 for ward, times 1/(1 + t)^2 for
    ward_duer, and times 1 - t for ward_gmd.
    """
    x, w = rule(0.0, 1.0)
    t, w = 1 - x, w * np.exp(-(1 - x) / alpha**2) / alpha**2
    closed = 1 - alpha**2 * (1 - math.exp(-1 / alpha**2))
    assert np.sum(w * (1 - t)) == pytest.approx(closed, abs=1e-9)
    expected = {
        "ward": np.sum(w * np.sqrt((1 - t) / (1 + t)) / (1 + t) ** 2),
        "ward_duer": np.sum(w / (1 + t) ** 2),
        "ward_gmd": closed,
    }
    for model, value in expected.items():
        # Smaller cosines count as GRAZING, and ward_duer's f cos is not 0 there.
        assert at_normal_incidence(model, kd=0.0, ks=1.0, alpha_x=alpha) == pytest.approx(value, abs=1e-6), model


def test_the_albedo_of_ward_gmd_stays_bounded_where_the_others_grow() -> None:
    v = [math.sin(1.57), 0.0, math.cos(1.57)]
    found = [
        directional_albedo(BRDFS[m](kd=0.0, ks=1.0, alpha_x=0.5), v, within=1e-4)[0] for m in ("ward", "ward_duer", "ward_gmd")
    ]
    assert found[0] > 2
    assert found[1] > 100
    assert 0.98 < found[2] < 1


def test_ward_gmd_by_its_unit_half_vector() -> None:
    """For a unit h, |H|^2 / (H.n)^4 is 1 / (4 (h.v)^2 (h.n)^4). Both forms are published, and code that mixes them up loses the
    factor 4."""
    l, v = np.array([0.48, -0.6, 0.64]), np.array([0.36, 0.48, 0.8])
    h = (l + v) / np.linalg.norm(l + v)
    x, y = 0.3, 0.2
    slope = ((h[0] / x) ** 2 + (h[1] / y) ** 2) / h[2] ** 2
    expected = math.exp(-slope) / (4 * math.pi * x * y * (h @ v) ** 2 * h[2] ** 4) * l[2]
    found = evaluate(BRDFS["ward_gmd"](kd=0.0, ks=1.0, alpha_x=x, alpha_y=y), l, v)
    assert found == pytest.approx(np.full(3, expected), rel=1e-6)


@pytest.mark.parametrize("model", WARDS)
def test_wards_are_one_at_small_angles(model: str) -> None:
    """At l = v = n all three models are 1 / (4 pi alpha^2)."""
    found = evaluate(BRDFS[model](kd=0.0, ks=1.0, alpha_x=0.1), UP, UP)
    assert found == pytest.approx(np.full(3, 1 / (0.04 * math.pi)), rel=1e-6)


# The first channel of Cornell's fit to blue house paint, as (Cx = Cy, Cz, n) of three lobes (Lafortune et al. 1997).
HOUSE_PAINT = [(0.870567, 0.774290, 21.820103), (-0.451218, 0.023123, 3.029342), (-1.031545, 0.706734, 66.899060)]


def test_lafortune_takes_published_lobes() -> None:
    """C is divided by its largest number c, and ks = 2 pi c^p / (p + 2)."""
    parameters: dict[str, Any] = {"kd": 0.3264}
    for i, (x, z, p) in enumerate(HOUSE_PAINT, 1):
        c = max(abs(x), abs(z))
        strength = 2 * math.pi * c**p / (p + 2)
        parameters |= {f"ks_{i}": strength, f"cx_{i}": x / c, f"cz_{i}": z / c, f"exponent_{i}": p}
    random = np.random.default_rng(1)
    l, v = (d / np.linalg.norm(d, axis=1, keepdims=True) for d in random.normal(size=(2, 200, 3)))
    l[:, 2], v[:, 2] = np.abs(l[:, 2]), np.abs(v[:, 2])
    f = np.full(200, 0.3264 / math.pi)
    for x, z, p in HOUSE_PAINT:
        f += np.maximum(x * (l[:, 0] * v[:, 0] + l[:, 1] * v[:, 1]) + z * l[:, 2] * v[:, 2], 0) ** p
    assert evaluate(BRDFS["lafortune"](**parameters), l, v)[:, 0] == pytest.approx(f * l[:, 2], rel=1e-4, abs=1e-6)


@pytest.mark.parametrize("cz", [1.0, 0.9, 0.25])
def test_the_albedo_of_a_lobe_at_normal_incidence(cz: float) -> None:
    for cx in (-1.0, 0.0, 1.0):
        found = at_normal_incidence("lafortune", kd=0.25, ks_1=0.5, cx_1=cx, cz_1=cz, exponent_1=7.5)
        assert found == pytest.approx(0.25 + 0.5 * cz**7.5, abs=1e-6)


def test_a_lobe_is_cut_off_before_its_power() -> None:
    """A negative base of the power gives 0, even with an even exponent."""
    lobe = BRDFS["lafortune"](kd=0.0, ks_1=1.0, cx_1=1.0, cz_1=-1.0, exponent_1=2.0)
    assert np.all(evaluate(lobe, UP, UP) == 0)


def test_lobes_that_are_not_there_are_not_in_the_program() -> None:
    model = BRDFS["lafortune"]
    one, two = model(), model(ks_3=0.25, cy_3=0.5)
    assert one.asked("light") == {"kd", "ks_1", "cx_1", "cz_1", "exponent_1"}
    assert one.asked("ambient") == {"kd"}
    assert two.asked("light") >= {"ks_3", "cy_1", "cy_3"}
    assert "ks_2" not in two.asked("light")
    assert "m.ks_3" in two.slots()["lobes"].text
    assert "m.ks_2" not in two.slots()["lobes"].text
    assert not one.needs_tangents
    assert two.needs_tangents
    assert model(ks_1=0.0).canonical(True) == BRDFS["lambert"](kd=0.5)
    assert two.canonical(True) is two


@pytest.mark.parametrize("model", [*NORMALISED, *WARDS])
def test_without_a_lobe_it_is_drawn_as_lambert(model: str) -> None:
    assert BRDFS[model](kd=0.25, ks=0.0, sides="both").canonical(True) == BRDFS["lambert"](kd=0.25, sides="both")
    assert BRDFS[model](kd=0.25).canonical(True).brdf == model


def test_tangents_are_asked_for_where_they_matter(tmp_path: Any) -> None:
    (tmp_path / "a.png").write_bytes(b"")
    texture = Texture(texture=tmp_path / "a.png")
    ward = BRDFS["ward"]
    for same in (ward(), ward(alpha_x=0.25, alpha_y=0.25), ward(alpha_x=texture)):
        assert not same.needs_tangents
        assert "f.t" not in expand("brdf/ward.glsl", slot_code(same.slots())).text
    for other in (ward(alpha_y=0.25), ward(alpha_x=texture, alpha_y=texture)):
        assert other.needs_tangents
        assert "f.t" in expand("brdf/ward.glsl", slot_code(other.slots())).text


@pytest.mark.parametrize("on", ["vertex", "fragment"])
@pytest.mark.parametrize(
    ("model", "x", "y"), [("ward", "alpha_x", "alpha_y"), ("ward_gmd", "alpha_x", "alpha_y"), ("lafortune", "cx_1", "cy_1")]
)
def test_the_text_without_tangents_has_the_same_value(model: str, x: str, y: str, on: Any, renderer: Renderer) -> None:
    width = float(np.float32(0.3))
    same = BRDFS[model](**{x: width})
    nearly = BRDFS[model](**{x: width, y: float(np.nextafter(np.float32(width), np.float32(1)))})
    assert same.slots() != nearly.slots()
    random = np.random.default_rng(1)
    l, v = (d / np.linalg.norm(d, axis=1, keepdims=True) for d in random.normal(size=(2, 300, 3)))
    one, other = (evaluate(material, l, v, on=on, context=renderer.context) for material in (same, nearly))
    assert one == pytest.approx(other, rel=1e-4, abs=1e-6)


def strauss_by_the_paper(l: Array, v: Array, colour: float, s: float, m: float) -> float:
    """Strauss 1990 as in the paper, without transparency. Its constants are kf = 1.12, kg = 1.01 and k = 0.1."""
    kf, kg = 1.12, 1.01
    alpha, gamma = (math.acos(d[2]) / (math.pi / 2) for d in (l, v))

    def f(x: float) -> float:
        return (1 / (x - kf) ** 2 - 1 / kf**2) / (1 / (1 - kf) ** 2 - 1 / kf**2)

    def g(x: float) -> float:
        return (1 / (1 - kg) ** 2 - 1 / (x - kg) ** 2) / (1 / (1 - kg) ** 2 - 1 / kg**2)

    rd = 1 - s**3
    rn = 1 - rd
    rj = min(1.0, rn + (rn + 0.1) * f(alpha) * g(alpha) * g(gamma))
    mirrored = 2 * l[2] * UP - l
    lobe = max(float(mirrored @ v), 0) ** (3 / (1 - s))
    cs = 1 + m * (1 - f(alpha)) * (colour - 1)
    return float(l[2] * (1 - m * s) * rd * colour + lobe * rj * cs) / math.pi


@pytest.mark.parametrize(("s", "m"), [(0.0, 0.0), (0.6, 0.5), (0.9, 1.0), (0.3, 0.0)])
def test_strauss_is_the_papers(s: float, m: float) -> None:
    random = np.random.default_rng(1)
    l, v = (d / np.linalg.norm(d, axis=1, keepdims=True) for d in random.normal(size=(2, 100, 3)))
    l[:, 2], v[:, 2] = np.abs(l[:, 2]), np.abs(v[:, 2])
    v[:50] = l[:50] * [-1, -1, 1] + random.normal(scale=0.05, size=(50, 3))
    v[:, 2] = np.abs(v[:, 2])
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    expected = [strauss_by_the_paper(*pair, 0.4, s, m) for pair in zip(l, v, strict=True)]
    found = evaluate(BRDFS["strauss"](kd=0.4, smoothness=s, metalness=m), l, v)[:, 0]
    assert found == pytest.approx(np.array(expected), rel=2e-5, abs=1e-6)


def test_strauss_shines_at_grazing_angles_and_not_face_on() -> None:
    """Cosines in place of angles would make it shine face on."""
    dull = BRDFS["strauss"](kd=0.0, smoothness=0.0, metalness=0.0)
    low = np.array([math.sin(1.4), 0.0, math.cos(1.4)])
    assert evaluate(dull, UP, UP).max() == 0
    assert evaluate(dull, low, low * [-1, -1, 1]).min() > 0.005


@pytest.mark.parametrize("on", ["reference", "vertex", "fragment"])
def test_strauss_at_its_pole(on: Any, renderer: Renderer) -> None:
    """At smoothness 1 the highlight has the exponent 1e8, and there is no diffuse light."""
    mirror = BRDFS["strauss"](kd=1.0, smoothness=1.0, metalness=0.0)
    beside = np.array([1e-3, 0.0, 1.0])
    found = evaluate(mirror, UP, np.stack([UP, beside]), on=on, context=renderer.context)
    assert found[0] == pytest.approx(np.full(3, 1 / math.pi), rel=1e-6)
    assert np.all(found[1] < 1e-20)


@pytest.mark.parametrize(
    "model",
    ["phong_normalised", "retro_phong", "blinn_phong_normalised", "minnaert", "ward", "ward_duer", "ward_gmd"],
)
def test_the_reference_runs_in_float32(model: str) -> None:
    """The bounds of a picture's pixels are computed in float32. The models must not widen it to float64."""
    brdf = BRDFS[model]()
    values = {name: np.asarray(value, dtype=np.float32) for name, value in filled_in(brdf).items()}
    d = np.array([[0.48, 0.6, 0.64], [1.0, 0.0, 1e-30], [0.0, 0.0, 0.0]], dtype=np.float32)
    for l, v in ((d, d), (d, d[::-1]), (d, -d)):
        found = type(brdf).brdf_cos(type("M", (), values), l, v)
        assert found.dtype == np.float32
        assert np.all(np.isfinite(found))
