"""ward: an anisotropic Gaussian of the half vector's slope."""

import math
from typing import Any, ClassVar, Literal

import numpy as np

from glshade.brdfs import Array, Brdf, Colour, Law, Limit, Parameter, Scalar, above_horizon, parameter
from glshade.brdfs.lambert import Lambert
from glshade.brdfs.phong import without_lobe
from glshade.textures.texture import Texture

# Models that divide by a cosine count a smaller one as this, some ten float32 roundings above 0.
GRAZING = 2.0**-20


class Gaussian(Brdf):
    """What ward, ward_duer and ward_gmd share: kd/pi and a Gaussian of widths alpha_x, alpha_y in the tangent of the angle
    between n and h."""

    isotropic_where: ClassVar[dict[str, str | float]] = {"alpha_y": "alpha_x"}

    kd: Colour = parameter((0.4, 0.4, 0.4), Parameter("diffuse reflectance", base=True))
    ks: Colour = parameter((0.2, 0.2, 0.2), Parameter("specular reflectance"))
    alpha_x: Scalar = parameter(0.15, Parameter("slope's spread along the tangent", low=1e-4, high=1.0, usual=(0.05, 0.5)))
    alpha_y: Scalar | None = parameter(
        None,
        Parameter(
            "slope's spread along the bitangent; left out: alpha_x",
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
            Limit("alpha_y left out is alpha_x", make(alpha_x=0.3), make(alpha_x=0.3, alpha_y=0.3)),
        )

    def canonical(self, ambient: bool) -> Brdf:
        return without_lobe(self, ambient)

    @property
    def needs_tangents(self) -> bool:
        return self.alpha_y is not None and (isinstance(self.alpha_x, Texture) or self.alpha_x != self.alpha_y)

    def slots(self) -> dict[str, str]:
        return {"across": f'#include "lib/across_{"anisotropic" if self.needs_tangents else "isotropic"}.glsl"\n'}

    def specular_part(self) -> Brdf:
        return self.without_base()

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        return m.kd  # type: ignore[no-any-return]


class Ward(Gaussian):
    """(kd/pi + ks exp(-slope^2) / (4 pi alpha_x alpha_y sqrt((n.l) (n.v)))) n.l.

    slope^2 = ((H.t/alpha_x)^2 + (H.b/alpha_y)^2) / (H.n)^2 with H = l + v. Reciprocal, and darker than ks away from normal
    incidence; but f cos grows as 1/sqrt(n.v), and the albedo with it. Each cosine under the root, and H.n, counts as 2^-20
    where it is smaller. Reflects ambient light with kd.
    """

    source: ClassVar[str] = "Ward 1992, eq. 5a; Walter 2005"
    breaks: ClassVar[dict[Law, str]] = {
        "energy": "f cos grows as 1/sqrt(n.v): at grazing angles a wide lobe reflects more than arrives (Duer 2006)"
    }

    brdf: Literal["ward"] = "ward"

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        lobe, _, _ = gaussian(m, l, v)
        low = np.maximum(l[..., 2], GRAZING) * np.maximum(v[..., 2], GRAZING)
        specular = lobe / (4 * math.pi * m.alpha_x * m.alpha_y * np.sqrt(low))
        return above_horizon(l, v, (m.kd / math.pi + m.ks * specular[..., None]) * l[..., 2:])


def gaussian(m: Any, l: Array, v: Array) -> tuple[Array, Array, Array]:
    """(exp(-slope^2), tan^2, H.n), each (...): slope^2 = (H.t/alpha_x)^2 + (H.b/alpha_y)^2 over (H.n)^2, H = l + v, and the
    square of the tangent of h's angle."""
    H = l + v
    height = np.maximum(H[..., 2], GRAZING)
    x, y = H[..., 0] / height, H[..., 1] / height
    return np.exp(-((x / m.alpha_x) ** 2 + (y / m.alpha_y) ** 2)), x * x + y * y, height
