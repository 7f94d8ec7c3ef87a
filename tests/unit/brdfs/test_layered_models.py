"""Tests the diffuse and layered models against plain transcriptions of their papers, and against Mitsuba 3."""

from __future__ import annotations

import math
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray
from support.strategies import directions

from glshade import BRDFS, Renderer, evaluate
from glshade.brdfs import Brdf
from glshade.brdfs.principled import gtr1, gtr2
from glshade.catalogue.albedo import directional_albedo
from glshade.gl.program import Program
from glshade.glsl.shaders import expand
from glshade.glsl.source import Source
from glshade.optics.fresnel import f_dielectric
from glshade.optics.interface import diffuse_fresnel, t_dielectric

try:
    import mitsuba

    mitsuba.set_variant("scalar_rgb")
except Exception:  # without /proc its import ends in a NameError
    mitsuba = None

Array = NDArray[np.float64]
KD = (0.8, 0.3, 0.05)


def pairs(count: int, seed: int, lowest: float = 0.02) -> tuple[Array, Array]:
    """l, v (count, 3): unit vectors in float64. lowest: their least cosine to n, since plain formulas fail near the horizon."""
    d = directions(8 * count, seed).astype(np.float64)
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    d = d[d[:, 2] > lowest]
    return d[:count], d[count : 2 * count]


def numbers(material: Brdf) -> Any:
    values = {name: np.asarray(getattr(material, name), dtype=np.float64) for name in material.parameters()}
    return SimpleNamespace(**values, **material.chosen())


def on_gpu(include: str, expression: str, x: Any, renderer: Renderer) -> NDArray[np.float32]:
    """Returns the values (N,) of a GLSL expression in l.x and l.y, which are the columns of x (N, 2). include: the file that it
    needs."""
    text = f'#include "{include}"\n\nvec3 value(vec3 l, vec3 v) {{\n    return vec3({expression} + 0.0 * v.x);\n}}\n'
    context = renderer.context
    rows = np.zeros((len(x), 3), dtype=np.float32)
    rows[:, :2] = x
    with context.gl as gl:
        program = Program(context, Source(expand("pass/evaluate.vert", {"model": text}), None), varyings=("v_value",))
        content = [(gl.buffer(rows.tobytes()), "3f", name) for name in ("a_l", "a_v") if name in program.attributes]
        result = gl.buffer(reserve=rows.nbytes)
        gl.simple_framebuffer((1, 1)).use()
        gl.vertex_array(program.gl, content).transform(result, moderngl.POINTS, vertices=len(rows))
        return np.frombuffer(result.read(), dtype=np.float32).reshape(-1, 3)[:, 0]


# Oren and Nayar


@pytest.mark.parametrize("sigma", [0.05, 0.3, 0.7, 1.2])
def test_oren_nayar_is_its_paper(sigma: float) -> None:
    """Eqs. 27-31, by angles. These plain forms lose digits near the horizon, which `pairs` avoids."""
    l, v = pairs(400, 1)
    ti, tr = np.arccos(np.minimum(l[:, 2], 1)), np.arccos(np.minimum(v[:, 2], 1))
    dphi = np.arctan2(l[:, 1], l[:, 0]) - np.arctan2(v[:, 1], v[:, 0])
    alpha, beta, s2 = np.maximum(ti, tr), np.minimum(ti, tr), sigma**2
    c1 = 1 - 0.5 * s2 / (s2 + 0.33)
    c2 = 0.45 * s2 / (s2 + 0.09) * np.where(np.cos(dphi) >= 0, np.sin(alpha), np.sin(alpha) - (2 * beta / np.pi) ** 3)
    c3 = 0.125 * s2 / (s2 + 0.09) * (4 * alpha * beta / np.pi**2) ** 2
    l1 = c1 + np.cos(dphi) * c2 * np.tan(beta) + (1 - np.abs(np.cos(dphi))) * c3 * np.tan((alpha + beta) / 2)
    l2 = 0.17 * s2 / (s2 + 0.13) * (1 - np.cos(dphi) * (2 * beta / np.pi) ** 2)
    kd = np.array(KD)
    expected = np.maximum(kd / np.pi * l1[:, None] + kd**2 / np.pi * l2[:, None], 0) * l[:, 2:]
    full = BRDFS["oren_nayar"](kd=KD, sigma=sigma)
    np.testing.assert_allclose(type(full).brdf_cos(numbers(full), l, v), expected, rtol=1e-6, atol=1e-9)
    c2 = 0.45 * s2 / (s2 + 0.09) * np.maximum(np.cos(dphi), 0) * np.sin(alpha) * np.tan(beta)
    expected = kd / np.pi * (c1 + c2)[:, None] * l[:, 2:]
    short = BRDFS["oren_nayar_qualitative"](kd=KD, sigma=sigma)
    np.testing.assert_allclose(type(short).brdf_cos(numbers(short), l, v), expected, rtol=1e-6, atol=1e-9)


def test_oren_nayar_at_the_pole_has_no_azimuth() -> None:
    """As l approaches n, the value has the same limit from all sides."""
    v = np.array([0.6, 0.0, 0.8])
    for name in ("oren_nayar", "oren_nayar_qualitative"):
        m = numbers(BRDFS[name](kd=1.0, sigma=1.0))
        pole = BRDFS[name].brdf_cos(m, np.array([0.0, 0.0, 1.0]), v)
        for tilt in (1e-3, 1e-6, 1e-9, 1e-160):
            for angle in np.linspace(0, 6, 13):
                l = np.array([tilt * math.cos(angle), tilt * math.sin(angle), math.sqrt(1 - tilt**2)])
                assert np.abs(BRDFS[name].brdf_cos(m, l, v) - pole).max() <= tilt + 1e-15


def test_oren_nayar_brightness_at_sigma_1(renderer: Renderer) -> None:
    """The faulty A = 1 + s^2 (1/(s^2 + 0.13) + 0.5/(s^2 + 0.33)) of some published code would be 3.6 times as bright."""
    up = np.float32([0, 0, 1])
    for on in ("reference", "vertex", "fragment"):
        value = evaluate(BRDFS["oren_nayar_qualitative"](kd=1.0, sigma=1.0), up, up, on, renderer.context)  # type: ignore[arg-type]
        assert value * np.pi == pytest.approx(1 - 0.5 / 1.33, rel=1e-6)
    copied = 1 + 1 / 1.13 + 0.5 / 1.33
    assert copied / (1 - 0.5 / 1.33) == pytest.approx(3.62, abs=0.01)


@pytest.mark.parametrize("name", ["oren_nayar_qualitative", "oren_nayar"])
def test_oren_nayar_does_not_clamp_l_v(name: str, renderer: Renderer) -> None:
    """If l.v were clamped to [eps, 1], grazing light against the viewer would be as bright as light from the viewer's side."""
    z = np.float32(1e-3)
    r = np.float32(math.sqrt(1 - 1e-6))
    v, toward, away = np.float32([[r, 0, z], [r, 0, z], [-r, 0, z]])
    for on in ("reference", "vertex", "fragment"):
        material = BRDFS[name](kd=1.0, sigma=0.5)
        bright, dark = evaluate(material, np.stack([toward, away]), v, on, renderer.context)  # type: ignore[arg-type]
        assert np.all(bright / dark > 1.4)
        if name == "oren_nayar_qualitative":
            assert dark * np.pi / z == pytest.approx(1 - 0.5 * 0.25 / 0.58, rel=1e-5)


def test_oren_nayar_is_never_negative(renderer: Renderer) -> None:
    """From sigma 0.67 on, and seen against grazing light, the negative C2 term exceeds C1. A bright surface makes up for it by
    L2."""
    l, v = np.float32([[0.99955, 0, 0.03]] * 2), np.float32([[-0.99955, 0, 0.03], [0.99955, 0, 0.03]])
    for on in ("reference", "vertex", "fragment"):
        dark, bright = (
            evaluate(BRDFS["oren_nayar"](kd=kd, sigma=1.2), l, v, on, renderer.context)  # type: ignore[arg-type]
            for kd in (0.1, 1.0)
        )
        assert np.all(dark[0] == 0)
        assert np.all(dark[1] > 0)
        assert np.all(bright > 0)


def test_how_much_oren_nayar_gives_back() -> None:
    """The figures are those in the models' `breaks`."""
    grazing = np.array([math.sqrt(1 - 1e-6), 0, 1e-3])
    assert directional_albedo(BRDFS["oren_nayar"](kd=1.0, sigma=0.3), grazing, 1e-4).max() == pytest.approx(1.051, abs=1e-3)
    assert directional_albedo(BRDFS["oren_nayar_qualitative"](kd=1.0, sigma=0.2), grazing, 1e-4).max() == pytest.approx(
        1.015, abs=1e-3
    )


def test_right_angles_on_the_gpu(renderer: Renderer) -> None:
    """acos would err by 4e-4 on llvmpipe. The measured relative error of this function is 2.1e-7."""
    angle = np.concatenate([np.linspace(0, np.pi / 2, 20001), 10.0 ** -np.arange(1, 30)])
    x = np.stack([np.sin(angle), np.maximum(np.cos(angle), 0)], axis=1).astype(np.float32)
    exact = np.arctan2(x[:, 0].astype(np.float64), x[:, 1].astype(np.float64)) / (np.pi / 2)
    found = on_gpu("math/right_angles.glsl", "right_angles(l.x, l.y)", x, renderer)
    assert np.all(np.abs(found - exact) <= 3e-7 * exact)


# Plastic and paint


ETAS = np.array([1, 1 + 1e-9, 1.0001, 1.01, 1.1, 1.222, 1.2223, 1.33, 1.5, 2, 3])


def test_diffuse_fresnel_is_its_integral() -> None:
    nodes, weights = np.polynomial.legendre.leggauss(400)
    u, weights = (nodes[:, None] + 1) / 2, weights[:, None] / 2
    # c = u^4 puts many points at grazing angles, where the integrand is steep.
    integral = np.sum(f_dielectric(u**4, ETAS) * 2 * u**4 * 4 * u**3 * weights, axis=0)
    assert diffuse_fresnel(ETAS) == pytest.approx(integral, abs=1e-13)
    # From inside there is total reflection beyond the critical angle, and the other paths are those from outside, reversed.
    eta = 1.5
    inside = math.sqrt(1 - 1 / eta**2)
    c = inside + (1 - inside) * u**2
    out = np.sqrt(np.maximum(1 - eta**2 * (1 - c**2), 0))
    integral = inside**2 + np.sum(f_dielectric(out, eta) * 2 * c * (1 - inside) * 2 * u * weights)
    assert 1 - (1 - diffuse_fresnel(eta)) / eta**2 == pytest.approx(integral, abs=1e-9)


def test_what_passes_is_what_is_not_reflected() -> None:
    c, eta = np.meshgrid(np.linspace(0, 1, 101), ETAS)
    assert t_dielectric(c, eta) == pytest.approx(1 - f_dielectric(c, eta), abs=1e-14)
    assert t_dielectric(1e-30, 1.5) == pytest.approx(2e-30 * (1 + 1.5**2) / math.sqrt(1.25), rel=1e-12)


def test_the_interface_on_the_gpu(renderer: Renderer) -> None:
    eta = np.concatenate([np.linspace(1, 3, 2001), 1 + 10.0 ** -np.arange(1, 8)]).astype(np.float32)
    x = np.stack([np.resize(directions(512, 1)[:, 2], len(eta)), eta], axis=1)
    c, wide = x.astype(np.float64).T
    file = "lobe/interface_exact.glsl"
    assert on_gpu(file, "interface_diffuse(l.y)", x, renderer) == pytest.approx(diffuse_fresnel(wide), abs=5e-7)
    assert on_gpu(file, "interface_passes(l.x, l.y)", x, renderer) == pytest.approx(t_dielectric(c, wide), rel=1e-6)


@pytest.mark.parametrize("fresnel", ["exact", "schlick"])
@pytest.mark.parametrize("ior", [1.0, 1.2, 1.5, 3.0])
def test_a_white_base_gives_back_all_that_went_in(ior: float, fresnel: str) -> None:
    v = np.stack([np.sqrt(1 - (z := np.array([1.0, 0.7, 0.3, 0.05])) ** 2), 0 * z, z], axis=1)
    white, black = (directional_albedo(BRDFS["plastic"](kd=kd, ior=ior, fresnel=fresnel), v, 1e-7) for kd in (1.0, 0.0))
    f0 = ((ior - 1) / (ior + 1)) ** 2
    inside = t_dielectric(z, ior) if fresnel == "exact" else 1 - f0 - (1 - f0) * (1 - z) ** 5
    assert white - black == pytest.approx(np.repeat(inside[:, None], 3, axis=1), abs=1e-5)


def test_plastic_is_darker_and_deeper_in_colour_than_its_base() -> None:
    up = np.float32([0, 0, 1])
    base = evaluate(BRDFS["plastic"](kd=(0.8, 0.4, 0.1)), up, np.float32([0.6, 0, 0.8]))
    assert np.all(base < np.array([0.8, 0.4, 0.1]) / np.pi)
    assert base[0] / base[1] > 2


def test_a_coat_dims_what_lies_below() -> None:
    l, v = pairs(100, 3)
    bare, coated = (BRDFS["paint"](kd=KD, flakes=0.5, coat=coat, coat_roughness=0.01) for coat in (0.0, 1.0))
    below, above = (type(m).brdf_cos(numbers(m), l, v) for m in (bare, coated))
    dimmed = below * (t_dielectric(l[:, 2:], 1.5) * t_dielectric(v[:, 2:], 1.5))
    away = np.linalg.norm(np.cross((l + v) / np.linalg.norm(l + v, axis=1)[:, None], [0, 0, 1]), axis=1) > 0.1
    assert away.sum() > 50
    # Away from h = n the coat's highlight adds nothing, because it is narrow.
    np.testing.assert_allclose(above[away], dimmed[away], atol=1e-4)
    assert np.all(above >= dimmed)


# Principled


def plain(m: Any, l: Array, v: Array) -> Array:
    """Returns the published model times n.l, computed by plain cosines. It is exact enough for lobes that are not
    too narrow.
    """
    NoL, NoV = l[:, 2], v[:, 2]
    h = (l + v) / np.linalg.norm(l + v, axis=1)[:, None]
    NoH, LoH = h[:, 2], np.sum(l * h, axis=1)
    kd = np.asarray(m.kd)
    hue = kd / (0.3 * kd[0] + 0.6 * kd[1] + 0.1 * kd[2])
    f0 = (1 - m.metallic) * 0.08 * m.specular * (1 - m.specular_tint + m.specular_tint * hue) + m.metallic * kd
    fl, fv, fh = ((1 - c) ** 5 for c in (NoL, NoV, LoH))
    f90 = 0.5 + 2 * m.roughness * LoH**2
    fd = (1 + (f90 - 1) * fl) * (1 + (f90 - 1) * fv)
    fss90 = m.roughness * LoH**2
    fss = (1 + (fss90 - 1) * fl) * (1 + (fss90 - 1) * fv)
    ss = 1.25 * (fss * (1 / (NoL + NoV) - 0.5) + 0.5)
    aspect = math.sqrt(1 - 0.9 * m.anisotropy)
    ax, ay = m.roughness**2 / aspect, m.roughness**2 * aspect
    ds = 1 / (math.pi * ax * ay * ((h[:, 0] / ax) ** 2 + (h[:, 1] / ay) ** 2 + NoH**2) ** 2)

    def g(c: Array, a: float) -> Array:
        value: Array = 1 / (c + np.sqrt(a**2 + c**2 - a**2 * c**2))
        return value

    wide = (0.5 + m.roughness / 2) ** 2
    gs = g(NoL, wide) * g(NoV, wide)
    a2 = (0.1 + (0.001 - 0.1) * m.clearcoat_gloss) ** 2
    dr = (a2 - 1) / (math.pi * math.log(a2) * (1 + (a2 - 1) * NoH**2))
    coat = 0.25 * m.clearcoat * g(NoL, 0.25) * g(NoV, 0.25) * (0.04 + 0.96 * fh) * dr
    sheen = (fh * m.sheen)[:, None] * (1 - m.sheen_tint + m.sheen_tint * hue)
    diffuse = (fd + (ss - fd) * m.subsurface)[:, None] * kd / math.pi
    specular = (gs * ds)[:, None] * (f0 + (1 - f0) * fh[:, None])
    value: Array = ((diffuse + sheen) * (1 - m.metallic) + specular + coat[:, None]) * l[:, 2:]
    return value


@pytest.mark.parametrize("seed", range(20))
def test_principled_is_what_was_published(seed: int) -> None:
    random = np.random.default_rng(seed)
    model = BRDFS["principled"]
    values: dict[str, Any] = {name: float(random.uniform()) for name in model.parameters()}
    values |= {"kd": tuple(random.uniform(0.05, 1, 3).tolist()), "roughness": float(random.uniform(0.3, 1))}
    # The plain form of the narrowest coat loses its digits, so it is left out.
    values["clearcoat_gloss"] *= 0.9
    l, v = pairs(200, seed)
    m = numbers(model(**values))
    np.testing.assert_allclose(model.brdf_cos(m, l, v), plain(m, l, v), rtol=1e-8)


def test_principled_has_the_diffuse_of_burley() -> None:
    l, v = pairs(200, 5)
    coloured, black = (BRDFS["principled"](kd=kd, roughness=0.7) for kd in (KD, 0.0))
    burley = BRDFS["burley"](kd=KD, roughness=0.7)
    difference = type(coloured).brdf_cos(numbers(coloured), l, v) - type(black).brdf_cos(numbers(black), l, v)
    np.testing.assert_allclose(difference, type(burley).brdf_cos(numbers(burley), l, v), rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("gloss", [0.0, 0.5, 1.0])
def test_facets_cover_the_surface_once(gloss: float) -> None:
    """The projected area of all facets is that of the surface, so the integral of D cos is 1, for both distributions."""
    # x is sin^2 of the half vector's angle, on a logarithmic scale; phi goes round.
    nodes, weights = np.polynomial.legendre.leggauss(200)
    x = np.exp(nodes * 18 - 18)
    phi = np.linspace(0, 2 * np.pi, 180, endpoint=False)
    r, phi = np.broadcast_arrays(np.sqrt(x)[:, None], phi[None])
    h = np.stack([r * np.cos(phi), r * np.sin(phi), np.sqrt(np.maximum(1 - r * r, 0))], axis=-1)
    # cos sin dtheta = d(sin^2) / 2
    measure = weights[:, None] * 18 * x[:, None] / 2 * (2 * np.pi / phi.shape[1])
    a = 0.1 * (1 - gloss) + 0.001 * gloss
    assert np.sum(gtr1(h, np.array(a)) * measure) == pytest.approx(1, abs=1e-6)
    assert np.sum(gtr2(h, np.array(0.3), np.array(gloss)) * measure) == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize(
    ("values", "there", "gone"),
    [
        ({}, {"burley", "gtr2_isotropic"}, {"clearcoat", "sheen", "tint", "flat_subsurface", "metallic", "gtr2_anisotropic"}),
        ({"metallic": 1.0, "sheen": 1.0, "subsurface": 0.5}, {"gtr2_isotropic"}, {"burley", "sheen", "subsurface", "specular"}),
        ({"subsurface": 1.0}, {"flat_subsurface"}, {"burley", "m.subsurface"}),
        ({"subsurface": 0.5}, {"burley", "flat_subsurface", "m.subsurface"}, set()),
        ({"anisotropy": 0.5}, {"gtr2_anisotropic"}, {"gtr2_isotropic"}),
        ({"clearcoat": 1.0, "sheen": 1.0}, {"lobe/clearcoat", "m.sheen", "lobe/tint"}, {"m.metallic"}),
    ],
)
def test_principled_lobes_drop_out(values: dict[str, float], there: set[str], gone: set[str]) -> None:
    material = BRDFS["principled"](**values)
    lobes = material.slots()["lobes"]
    text = " ".join([*lobes.includes, lobes.text])
    assert all(name in text for name in there)
    assert not [name for name in gone if name in text]
    # A parameter is asked for exactly where the program reads it. gtr2_isotropic has an argument for the anisotropy that it
    # ignores.
    read = set(re.findall(r"\bm\.(\w+)", text)) - ({"anisotropy"} if not material.needs_tangents else set())
    assert material.asked("light") == read
    assert material.needs_tangents == (values.get("anisotropy", 0) != 0)


def test_a_texture_is_never_nothing(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(b"")
    texture = {"texture": tmp_path / "a.png"}
    model = BRDFS["principled"]
    names = set(model.parameters()) - {"kd"}
    textured = model(**dict.fromkeys(names, texture))
    assert textured.asked("light") == set(model.parameters())
    assert textured.needs_tangents
    paint = BRDFS["paint"]
    assert paint(flakes=texture, coat=texture).asked("light") == set(paint.parameters())
    assert paint(flakes=0.0, ior=1.0).canonical(False).brdf == "lambert"
    assert paint(flakes=0.0, coat=0.0).asked("light") == {"kd"}
    assert paint(flakes=1.0, coat=0.0).asked("light") == {"flakes", "flake_colour", "flake_roughness"}


def test_how_much_principled_gives_back() -> None:
    grazing = np.array([math.sqrt(1 - 1e-6), 0, 1e-3])
    most = BRDFS["principled"](kd=1.0, sheen=1.0, clearcoat=1.0, specular=1.0, roughness=1.0)
    assert directional_albedo(most, grazing, 1e-4).max() == pytest.approx(1.73, abs=0.01)
    # Metals keep the law.
    for roughness in (0.1, 0.5, 1.0):
        assert directional_albedo(BRDFS["principled"](kd=1.0, metallic=1.0, roughness=roughness), grazing, 1e-4).max() <= 1


# Mitsuba


def theirs(plugin: dict[str, Any], l: Array, v: Array) -> Array:
    """f cos (N, 3) [1/sr] of a Mitsuba BSDF. plugin: its dictionary."""
    bsdf = mitsuba.load_dict(plugin)
    seen = mitsuba.SurfaceInteraction3f()
    found = []
    for light, viewer in zip(l, v, strict=True):
        seen.wi = viewer.tolist()
        found.append(np.array(bsdf.eval(mitsuba.BSDFContext(), seen, mitsuba.Vector3f(light.tolist()))).ravel())
    return np.array(found)


def rgb(*value: float) -> dict[str, Any]:
    return {"type": "rgb", "value": list(value)}


needs_mitsuba = pytest.mark.skipif(mitsuba is None, reason="Mitsuba (in the dev extra where it has wheels) cannot be used here")
BLACK = (0.0, 0.0, 0.0)


@needs_mitsuba
@pytest.mark.parametrize("roughness", [0.1, 0.6, 1.0])
def test_mitsuba_has_the_same_diffuse_and_sheen(roughness: float) -> None:
    """Mitsuba's principled is the revision of 2015, which has the same diffuse light and sheen. The difference to a black
    material removes the highlight."""
    l, v = pairs(100, 7)
    common = {"type": "principled", "roughness": roughness}
    black = theirs({**common, "base_color": rgb(*BLACK)}, l, v)
    diffuse = theirs({**common, "base_color": rgb(*KD)}, l, v) - black
    near = 1e-6 * np.maximum(1, black)
    assert np.all(np.abs(diffuse - evaluate(BRDFS["burley"](kd=KD, roughness=roughness), l, v)) <= near)
    sheen = theirs({**common, "base_color": rgb(*BLACK), "sheen": 1.0}, l, v) - black
    ours = [evaluate(BRDFS["principled"](kd=0.0, roughness=roughness, sheen=x, sheen_tint=0.0), l, v) for x in (0.0, 1.0)]
    assert np.all(np.abs(sheen - (ours[1] - ours[0])) <= near)


@needs_mitsuba
@pytest.mark.parametrize("ior", [1.1, 1.5, 2.0])
def test_mitsuba_has_the_same_plastic(ior: float) -> None:
    """Mitsuba's smooth plastic shows only the base. Its internal reflectance is a fit with an error of up to 2e-3."""
    l, v = pairs(100, 9)
    common = {"int_ior": ior, "ext_ior": 1.0, "nonlinear": True}
    base = theirs({"type": "plastic", "diffuse_reflectance": rgb(*KD), **common}, l, v)
    coloured, black = (evaluate(BRDFS["plastic"](kd=kd, ior=ior, roughness=0.01), l, v) for kd in (KD, BLACK))
    np.testing.assert_allclose(coloured - black, base, rtol=5e-3, atol=1e-6)
    # Mitsuba's shadowing is separable and ours is height-correlated, which makes little difference for a narrow highlight.
    rough = theirs(
        {"type": "roughplastic", "distribution": "ggx", "alpha": 0.01, "diffuse_reflectance": rgb(*BLACK), **common}, l, v
    )
    np.testing.assert_allclose(evaluate(BRDFS["plastic"](kd=0.0, ior=ior, roughness=0.1), l, v), rough, rtol=2e-3, atol=1e-7)
