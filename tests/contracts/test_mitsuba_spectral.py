"""Colours of spectra agree with those that Mitsuba 3's spectral variant has for the same tables, lamps and observer."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from glshade.assembly.assembly import assemble
from glshade.optics.observer import rgb_weights
from glshade.radiance.draw import draw_of
from glshade.radiance.surface import Surface, evaluate_surface
from glshade.scene.scene import Scene

try:
    import mitsuba

    if "scalar_spectral" not in mitsuba.variants():
        raise ImportError("it lacks the variant scalar_spectral")
except Exception as error:  # without /proc its import ends in a NameError
    pytest.skip(f"Mitsuba (in the dev extra where it has wheels) cannot be used here: {error!r}", allow_module_level=True)

PAINT = [(380.0, 0.1), (440.0, 0.5), (500.0, 0.15), (560.0, 0.7), (620.0, 0.3), (700.0, 0.9), (780.0, 0.2)]
ETA = [(300.0, 1.8), (450.0, 1.5), (520.0, 0.6), (600.0, 0.2), (880.0, 0.2)]
K = [(300.0, 1.9), (450.0, 1.9), (520.0, 2.2), (600.0, 3.0), (880.0, 5.4)]
# Both directions are the normal, where no facet shadows another.
UP = [0.0, 0.0, 1.0]
# The roughness whose alpha is 0.16.
ROUGHNESS, ALPHA = 0.4, 0.16
WAVELENGTHS = np.arange(360.0, 830.0)


@pytest.fixture(autouse=True)
def _variant() -> Any:
    """Sets the spectral variant, which other test files change."""
    before = mitsuba.variant() or "scalar_rgb"
    mitsuba.set_variant("scalar_spectral")
    yield
    mitsuba.set_variant(before)


def table(rows: Any) -> dict[str, Any]:
    return {"type": "spectrum", "value": rows}


def theirs(bsdf: dict[str, Any], lamp: str) -> np.ndarray:
    """Returns Mitsuba's colour (3,) of light that falls along the normal and is seen along it, for a lamp of luminance 1."""
    surface, seen = mitsuba.load_dict(bsdf), mitsuba.SurfaceInteraction3f()
    body = None if lamp == "D65" else mitsuba.load_dict({"type": "blackbody", "temperature": 2856.0})
    seen.wi = UP
    xyz, luminance = np.zeros(3), 0.0
    for start in range(0, len(WAVELENGTHS) - 3, 4):
        four = WAVELENGTHS[start : start + 4].tolist()
        seen.wavelengths = four
        values = np.ravel(surface.eval(mitsuba.BSDFContext(), seen, mitsuba.Vector3f(UP)))
        for wavelength, value in zip(four, values, strict=True):
            observer = np.ravel(mitsuba.cie1931_xyz(wavelength)).astype(np.float64)
            if body is None:
                power = float(np.ravel(mitsuba.cie_d65(wavelength))[0])
            else:
                seen.wavelengths = [wavelength] * 4
                power = float(np.ravel(body.eval(seen))[0])
                seen.wavelengths = four
            xyz += value * power * observer
            luminance += power * observer[1]
    return xyz / luminance


def ours(material: dict[str, Any], lamp: dict[str, Any]) -> np.ndarray:
    scene = Scene.model_validate(
        {
            "film": {"size": (8, 8), "bands": 90},
            "camera": {"type": "orthographic", "eye": (0, 0, 5), "height": 2.2},
            "objects": [{"shape": "sphere", "material": material}],
            # A light of intensity 1 lets a white Lambertian surface shine with 1, so that the result is pi times f cos.
            "lights": [{"type": "directional", "direction": (0, 0, -1), "colour": lamp, "intensity": 1 / np.pi}],
        }
    )
    assembly = assemble(scene)
    point = Surface(np.ones(1), np.array([[0.0, 0.0, -4.0]]), np.array([[0.0, 0.0, 1.0]]), None, None, None)
    return evaluate_surface(draw_of(scene, assembly, assembly.instances[0]), point)[0]


def as_rgb(xyz: np.ndarray) -> np.ndarray:
    from glshade.optics.observer import matching

    return np.linalg.lstsq(matching(), rgb_weights(), rcond=None)[0].T @ xyz


@pytest.mark.parametrize("lamp", ["D65", "A"])
def test_diffuse_and_conductor(lamp: str) -> None:
    light = {"spectrum": "D65"} if lamp == "D65" else {"blackbody": 2856}
    diffuse = theirs({"type": "diffuse", "reflectance": table(PAINT)}, lamp)
    paint = {"brdf": "lambert", "kd": {"spectrum": PAINT}}
    np.testing.assert_allclose(ours(paint, light), as_rgb(diffuse), atol=1e-3)
    conductor = theirs(
        {"type": "roughconductor", "distribution": "ggx", "alpha": ALPHA, "eta": table(ETA), "k": table(K)}, lamp
    )
    metal = {"brdf": "metal", "roughness": ROUGHNESS, "eta": {"spectrum": ETA}, "k": {"spectrum": K}}
    found = ours(metal, light)
    np.testing.assert_allclose(found, as_rgb(conductor), atol=1e-3 * float(found.max()))
