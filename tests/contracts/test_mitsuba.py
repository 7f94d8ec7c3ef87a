"""Models that Mitsuba 3 has too agree with its values to the precision of its float32."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from support.extremes import unit, upward

from glshade import evaluate
from glshade.brdfs import BRDFS
from glshade.brdfs.blinn_phong import half_vector
from glshade.optics.fresnel import f_conductor, f_dielectric
from glshade.optics.microfacet import alpha, alphas, d_beckmann, ggx_cos

try:
    import mitsuba

    mitsuba.set_variant("scalar_rgb")
except Exception as error:  # without /proc its import ends in a NameError
    pytest.skip(f"Mitsuba (in the dev extra where it has wheels) cannot be used here: {error!r}", allow_module_level=True)

# The error of Mitsuba's few operations in float32, half an ulp each.
FLOAT = 4e-7
UP = np.array([0.0, 0.0, 1.0])


def test_lambert_is_its_diffuse() -> None:
    """Mitsuba's eval includes the cosine, as f cos does. Both are 0 if l or v is below the horizon."""
    kd = (0.8, 0.3, 0.05)
    diffuse = mitsuba.load_dict({"type": "diffuse", "reflectance": {"type": "rgb", "value": list(kd)}})
    random = np.random.default_rng(3)
    l, v = (d / np.linalg.norm(d, axis=1, keepdims=True) for d in random.normal(size=(2, 300, 3)))
    l, v = l.astype(np.float32), v.astype(np.float32)
    ours = evaluate(BRDFS["lambert"](kd=kd), l, v)
    seen = mitsuba.SurfaceInteraction3f()
    for light, viewer, expected in zip(l, v, ours, strict=True):
        seen.wi = viewer.tolist()
        theirs = np.array(diffuse.eval(mitsuba.BSDFContext(), seen, mitsuba.Vector3f(light.tolist()))).ravel()
        np.testing.assert_allclose(expected, theirs, atol=FLOAT, rtol=FLOAT)
    assert (ours > 0).any()


def pairs(count: int, seed: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Returns l, v (count, 3) above the horizon; half of the viewers near the mirror direction."""
    l, v = upward(count, seed), upward(count, seed + 1)
    half = count // 2
    v[:half] = l[:half] * [-1, -1, 1] + np.random.default_rng(seed).normal(scale=0.1, size=(half, 3))
    v[:, 2] = np.abs(v[:, 2])
    return unit(l), unit(v)


@pytest.mark.parametrize(("eta", "k"), [(1.5, 0.0), (1.01, 0.0), (0.143, 3.983), (1.541, 1.676), (3.519, 4.351)])
def test_fresnel(eta: float, k: float) -> None:
    c = np.linspace(0.01, 1, 50)
    index = mitsuba.Complex2f(eta, k)
    theirs = [mitsuba.fresnel_conductor(float(x), index) for x in c]
    np.testing.assert_allclose(f_conductor(np.full(3, eta), np.full(3, k), c)[:, 0], theirs, atol=2e-6)
    if k == 0:
        theirs = [mitsuba.fresnel(float(x), eta)[0] for x in c]
        np.testing.assert_allclose(f_dielectric(c, np.array(eta)), theirs, atol=2e-6)


# (Mitsuba's type, ours, anisotropy)
LOBES = [("GGX", "metal", 0.0), ("GGX", "metal", 0.7), ("Beckmann", "beckmann", 0.0)]


@pytest.mark.parametrize("roughness", [0.2, 0.5, 1.0])
@pytest.mark.parametrize(("kind", "name", "anisotropy"), LOBES)
def test_rough_conductor(kind: str, name: str, anisotropy: float, roughness: float) -> None:
    """Mitsuba's shadowing is separable, G1(l) G1(v); ours is height-correlated, 1/(1/G1(l) + 1/G1(v) - 1).

    So the test divides Mitsuba's value by its shadowing, and multiplies it by the height-correlated form of Mitsuba's own G1.
    Its G1 for Beckmann is a fit: two of them have an error of 6e-3.
    """
    r = np.array(roughness)
    ax, ay = (float(a) for a in alphas(r, anisotropy))
    eta, k = (0.143, 0.375, 1.442), (3.983, 2.386, 1.603)
    theirs = mitsuba.load_dict(
        {"type": "roughconductor", "distribution": kind.lower(), "alpha_u": ax, "alpha_v": ay}
        | {name: {"type": "rgb", "value": list(value)} for name, value in (("eta", eta), ("k", k))}
    )
    microfacets = mitsuba.MicrofacetDistribution(getattr(mitsuba.MicrofacetType, kind), ax, ay)
    options = {"anisotropy": anisotropy} if name == "metal" else {"kd": 0.0}
    l, v = pairs(200, 3)
    ours = evaluate(BRDFS[name](eta=eta, k=k, roughness=roughness, **options), l, v)
    h, _ = half_vector(l.astype(np.float64), v.astype(np.float64))
    expected = []
    for light, viewer, middle in zip(l, v, h, strict=True):
        seen = mitsuba.SurfaceInteraction3f()
        seen.wi = viewer.tolist()
        whole = np.array(theirs.eval(mitsuba.BSDFContext(), seen, mitsuba.Vector3f(light.tolist()))).ravel()
        m = mitsuba.Vector3f(middle.tolist())
        one, other = (microfacets.smith_g1(mitsuba.Vector3f(d.tolist()), m) for d in (light, viewer))
        expected.append(whole / (one * other) / (1 / one + 1 / other - 1))
        # The distribution D is also compared by itself.
        d = 4 * ggx_cos(UP, UP, middle, r, anisotropy) if kind == "GGX" else d_beckmann(middle, alpha(r))
        assert microfacets.eval(m) == pytest.approx(d, rel=3e-5, abs=1e-6)
    peak = np.max(expected)
    np.testing.assert_allclose(ours, expected, atol=(1e-5 if kind == "GGX" else 6e-3) * peak)
    if kind == "GGX":
        np.testing.assert_allclose(ours, expected, rtol=1e-4, atol=1e-6)
