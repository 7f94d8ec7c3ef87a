"""strauss: one colour, smoothness and metalness, for animators."""

import math
from typing import Any, ClassVar, Literal

import numpy as np

from glshade.brdfs import Array, Brdf, Colour, Law, Parameter, Scalar, above_horizon, choice, parameter
from glshade.brdfs.phong import power_of_cosine

# Strauss's constants: of the Fresnel term, of the geometric one, and what grazing light adds to the reflectivity.
KF, KG, KJ = 1.12, 1.01, 0.1


class Strauss(Brdf):
    """(n.l (1 - m s) (1 - s^3) kd + max(r.v, 0)^h R C) / pi with smoothness s, metalness m, h = 3/(1 - s).

    a, g are the angles of l and v from n, over 90 degrees. R = min(1, s^3 + (s^3 + 0.1) F(a) G(a) G(g)) and
    C = 1 + m (1 - F(a)) (kd - 1). F(x) runs from 0 to 1 as 1/(x - 1.12)^2 does, G(x) from 1 to 0 as -1/(x - 1.01)^2.
    Not transparent. The lobe is phong's, not reciprocal. At s = 1, the pole of h, h is 1e8: 1 - s counts as 3e-8 where it is
    smaller. Published shaders that pass the cosine to F and G turn them round: brightest face on.
    Reflects ambient light with (1 - s^3) kd.
    """

    source: ClassVar[str] = "Strauss 1990"
    breaks: ClassVar[dict[Law, str]] = {
        "reciprocity": "the lobe is not divided by n.l, and its Fresnel term looks at the light alone",
        "energy": "the lobe comes on top of a diffuse term that leaves it no room: up to 0.5 % too much at smoothness 0",
    }

    brdf: Literal["strauss"] = "strauss"
    kd: Colour = parameter(
        (0.8, 0.5, 0.2), Parameter("the surface's colour, and its highlights' where it is metal", high=1.0, base=True)
    )
    smoothness: Scalar = parameter(0.6, Parameter("from dull to a mirror's small highlights", high=1.0, usual=(0.0, 0.95)))
    metalness: Scalar = parameter(0.5, Parameter("how far highlights have the surface's colour", high=1.0))
    lobes: Literal["all", "specular"] = choice("all", "specular: without diffuse light")

    def specular_part(self) -> Brdf:
        return self.model_copy(update={"lobes": "specular"})

    def slots(self) -> dict[str, str]:
        diffuse = "diffuse" if self.lobes == "all" else "dark"
        return {"diffuse": f'#include "lobe/strauss_{diffuse}.glsl"\n'}

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
    """The angles (...) of d (..., 3) from the normal and from the horizon, over 90 degrees; both keep their digits near 0.

    Below the horizon they are those of the horizon.
    """
    across, up = np.hypot(d[..., 0], d[..., 1]), np.maximum(d[..., 2], 0)
    return np.arctan2(across, up) * (2 / math.pi), np.arctan2(up, across) * (2 / math.pi)


def geometry(height: Array) -> Array:
    """G of an angle, by what is left of it to 90 degrees, over those."""
    return height * (height + 2 * (KG - 1)) / (height + (KG - 1)) ** 2 * (KG**2 / (2 * KG - 1))
