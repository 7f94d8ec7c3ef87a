"""strauss: a model for artists with one colour, a smoothness and a metalness."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from glshade.brdfs import Array, Brdf, Colour, Law, Parameter, Scalar, Slot, above_horizon, choice, parameter
from glshade.brdfs.phong import power_of_cosine

# Strauss's constants of the Fresnel term, of the geometric term, and of the extra reflectivity at grazing angles.
KF, KG, KJ = 1.12, 1.01, 0.1


class Strauss(Brdf):
    """(n.l (1 - m s) (1 - s^3) kd + max(r.v, 0)^h R C) / pi with smoothness s, metalness m and h = 3/(1 - s).

    a and g are the angles of l and v from n, divided by 90 degrees. R = min(1, s^3 + (s^3 + 0.1) F(a) G(a) G(g)) and C = 1 + m
    (1 - F(a)) (kd - 1). F(x) rises from 0 to 1 like 1/(x - 1.12)^2, and G(x) falls from 1 to 0 like -1/(x - 1.01)^2. The
    paper's transparency is left out. The lobe is phong's and not reciprocal. h has a pole at s = 1, so 1 - s is at least 3e-8
    and h at most 1e8. Published shaders that pass cosines to F and G are brightest where they should be darkest, face on. The
    model reflects ambient light with (1 - s^3) kd.
    """

    source: ClassVar[str] = "Strauss 1990"
    breaks: ClassVar[dict[Law, str]] = {
        "reciprocity": "the lobe is not divided by n.l, and its Fresnel term depends only on l",
        "energy": "the diffuse term does not shrink by the light of the lobe: up to 0.5 % too much leaves at smoothness 0",
    }
    samples: ClassVar[tuple[Mapping[str, Any], ...]] = (
        {"smoothness": 0.3, "metalness": 0},
        {"smoothness": 0.8, "metalness": 0},
        {"smoothness": 0.3, "metalness": 1},
        {"smoothness": 0.8, "metalness": 1},
    )
    linear: ClassVar[tuple[str, ...]] = ("kd",)

    brdf: Literal["strauss"] = "strauss"
    kd: Colour = parameter(
        (0.8, 0.5, 0.2), Parameter("colour of the surface, and of the highlights of a metal", high=1.0, base=True)
    )
    smoothness: Scalar = parameter(0.6, Parameter("0: dull, 1: small highlights as of a mirror", high=1.0, usual=(0.0, 0.95)))
    metalness: Scalar = parameter(0.5, Parameter("how far the highlights take the colour of the surface", high=1.0))
    lobes: Literal["all", "specular"] = choice("all", "all, or specular: without the diffuse lobe")

    def specular_part(self) -> Brdf:
        return self.model_copy(update={"lobes": "specular"})

    def slots(self) -> dict[str, Slot]:
        diffuse = "diffuse" if self.lobes == "all" else "dark"
        return {"diffuse": Slot((f"lobe/strauss_{diffuse}.glsl",))}

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        s, metal = m.smoothness, m.metalness
        smooth = s**3
        diffuse = l[..., 2] * (1 - metal * s) * (1 - s) * (1 + s + s * s) if m.lobes == "all" else np.zeros_like(l[..., 2])
        (a, height), (_, height_v) = elevation(l), elevation(v)
        f = a * (height + 2 * KF - 1) / (height + KF - 1) ** 2 * ((KF - 1) ** 2 / (2 * KF - 1))
        reflectivity = np.minimum(smooth + (smooth + KJ) * f * geometry(height) * geometry(height_v), 1)
        r = np.concatenate([-l[..., :2], l[..., 2:]], axis=-1)
        lobe = power_of_cosine(r, v, 3 / np.maximum(1 - s, 3e-8)) * reflectivity
        tint = metal * (1 - f)
        colour = m.kd * tint[..., None] + (1 - metal + metal * f)[..., None]
        return above_horizon(l, v, (m.kd * diffuse[..., None] + colour * lobe[..., None]) / math.pi)

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        return m.kd * (1 - m.smoothness**3)[..., None]  # type: ignore[no-any-return]


def elevation(d: Array) -> tuple[Array, Array]:
    """Returns the angles (...) of d (..., 3) from the normal and from the horizon, divided by 90 degrees; exact near 0.

    A direction below the horizon counts as in the horizon.
    """
    across, up = np.hypot(d[..., 0], d[..., 1]), np.maximum(d[..., 2], 0)
    return np.arctan2(across, up) * (2 / math.pi), np.arctan2(up, across) * (2 / math.pi)


def geometry(height: Array) -> Array:
    """Returns Strauss's term G (...) of a direction. height (...): its angle from the horizon, divided by 90 degrees."""
    return height * (height + 2 * (KG - 1)) / (height + (KG - 1)) ** 2 * (KG**2 / (2 * KG - 1))
