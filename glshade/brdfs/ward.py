"""ward: an anisotropic Gaussian lobe of the half vector's slope."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from glshade.brdfs import Array, Brdf, Colour, Law, Limit, Parameter, Scalar, Slot, above_horizon, parameter
from glshade.brdfs.lambert import Lambert
from glshade.brdfs.phong import without_lobe
from glshade.textures.texture import Texture

# The smallest cosine that models divide by: about ten ulps of a float32 near 1.
GRAZING = 2.0**-20


class Gaussian(Brdf):
    """The base class of ward, ward_duer and ward_gmd. Each adds kd/pi and a Gaussian of the slope of h, the tangent of the
    angle between n and h, with the widths alpha_x and alpha_y."""

    isotropic_where: ClassVar[dict[str, str | float]] = {"alpha_y": "alpha_x"}
    samples: ClassVar[tuple[Mapping[str, Any], ...]] = (
        {"alpha_x": 0.05},
        {"alpha_x": 0.15},
        {"alpha_x": 0.4},
        {"alpha_x": 0.4, "alpha_y": 0.1},
    )
    linear: ClassVar[tuple[str, ...]] = ("kd", "ks")

    kd: Colour = parameter((0.4, 0.4, 0.4), Parameter("diffuse reflectance", base=True))
    ks: Colour = parameter((0.2, 0.2, 0.2), Parameter("specular reflectance"))
    alpha_x: Scalar = parameter(
        0.15, Parameter("spread of the slopes along the tangent", low=1e-4, high=1.0, usual=(0.05, 0.5))
    )
    alpha_y: Scalar | None = parameter(
        None,
        Parameter(
            "spread of the slopes along the bitangent; default: alpha_x",
            low=1e-4,
            high=1.0,
            usual=(0.05, 0.5),
            same_as="alpha_x",
        ),
    )

    @classmethod
    def limits(cls) -> tuple[Limit, ...]:
        kd = (0.8, 0.5, 0.2)
        make: Any = cls
        return (
            Limit("ks = 0 is lambert", make(kd=kd, ks=(0.0, 0.0, 0.0)), Lambert(kd=kd)),
            Limit("alpha_y is alpha_x by default", make(alpha_x=0.3), make(alpha_x=0.3, alpha_y=0.3)),
        )

    def canonical(self, ambient: bool) -> Brdf:
        return without_lobe(self, ambient)

    @property
    def needs_tangents(self) -> bool:
        return self.alpha_y is not None and (isinstance(self.alpha_x, Texture) or self.alpha_x != self.alpha_y)

    def slots(self) -> dict[str, Slot]:
        form = "anisotropic" if self.needs_tangents else "isotropic"
        return {"across": Slot((f"surface/across_{form}.glsl",))}

    def specular_part(self) -> Brdf:
        return self.without_base()

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        return m.kd  # type: ignore[no-any-return]


class Ward(Gaussian):
    """(kd/pi + ks exp(-slope^2) / (4 pi alpha_x alpha_y sqrt((n.l) (n.v)))) n.l.

    slope^2 = ((H.t/alpha_x)^2 + (H.b/alpha_y)^2) / (H.n)^2 with H = l + v, the tangent t and the bitangent b. The model is
    reciprocal and reflects ambient light with kd. Away from normal incidence the lobe first reflects less than ks, but at
    grazing angles f cos and the albedo grow as 1/sqrt(n.v). The cosines under the root and H.n are at least 2^-20.
    """

    source: ClassVar[str] = "Ward 1992, eq. 5a; Walter 2005"
    breaks: ClassVar[dict[Law, str]] = {
        "energy": "f cos grows as 1/sqrt(n.v): at grazing angles a wide lobe reflects more light than arrives (Duer 2006)"
    }

    brdf: Literal["ward"] = "ward"

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        lobe, _, _ = gaussian(m, l, v)
        low = np.maximum(l[..., 2], GRAZING) * np.maximum(v[..., 2], GRAZING)
        specular = lobe / (4 * math.pi * m.alpha_x * m.alpha_y * np.sqrt(low))
        return above_horizon(l, v, (m.kd / math.pi + m.ks * specular[..., None]) * l[..., 2:])


def gaussian(m: Any, l: Array, v: Array) -> tuple[Array, Array, Array]:
    """Returns exp(-slope^2), the squared tangent of the angle between n and h, and H.n, each (...), with H = l + v.

    slope^2 = ((H.t/alpha_x)^2 + (H.b/alpha_y)^2) / (H.n)^2.
    """
    H = l + v
    height = np.maximum(H[..., 2], GRAZING)
    x, y = H[..., 0] / height, H[..., 1] / height
    return np.exp(-((x / m.alpha_x) ** 2 + (y / m.alpha_y) ** 2)), x * x + y * y, height
