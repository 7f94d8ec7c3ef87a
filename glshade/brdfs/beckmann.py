"""beckmann: Cook and Torrance's model with Beckmann's distribution over a diffuse base."""

import math
from typing import Any, ClassVar, Literal

import numpy as np

from glshade.brdfs import Array, Brdf, Colour, Limit, Parameter, Scalar, Slot, above_horizon, choice, parameter
from glshade.brdfs.blinn_phong import half_vector
from glshade.brdfs.lambert import Lambert
from glshade.brdfs.metal import cos_half, fresnel
from glshade.optics.fresnel import t0_conductor, t_conductor, t_schlick
from glshade.optics.microfacet import alpha, d_beckmann, smith_beckmann, v_groove


class Beckmann(Brdf):
    """kd/pi T(n.l) T(n.v) n.l + F(l.h) D(h) G(l, v) / (4 n.v), where F is the Fresnel of the index eta + i k and T = 1 - F.

    D is Beckmann's distribution of the facets, and G is the shadowing that the option `geometry` names. The paper divides by
    pi, and its D lacks a pi, which gives four times this value; Walter et al. 2007, eq. 20 show that the factor 1/4 is right.
    The paper's slope m is roughness^2. The paper adds a constant diffuse share, so that more light could leave than arrives.
    Here the diffuse part gets the light that the mean surface transmits on the way in and on the way out (Shirley et al. 1997).
    The model is reciprocal and reflects ambient light with kd. Where l = -v there is no half vector, and the specular part
    is 0.
    """

    source: ClassVar[str] = "Cook and Torrance 1982; Walter et al. 2007, eqs. 20, 25; Heitz 2014, eq. 99"
    linear: ClassVar[tuple[str, ...]] = ("kd",)

    brdf: Literal["beckmann"] = "beckmann"
    kd: Colour = parameter((0.5, 0.5, 0.5), Parameter("diffuse reflectance", high=1.0, base=True))
    eta: Colour = parameter((1.5, 1.5, 1.5), Parameter("index of refraction", low=0.01, high=100.0, usual=(1.1, 4.0)))
    k: Colour = parameter((0.0, 0.0, 0.0), Parameter("extinction", high=100.0, usual=(0.0, 8.0)))
    roughness: Scalar = parameter(
        0.5,
        Parameter("square root of alpha, the spread of the slopes; below 0.01 it counts as 0.01", high=1.0, usual=(0.2, 1.0)),
    )
    geometry: Literal["smith", "v_groove"] = choice(
        "smith", "shadowing: Smith's, height-correlated; or V-shaped grooves (1982)"
    )
    fresnel: Literal["exact", "schlick"] = choice(
        "exact", "exact, or Schlick's approximation; its error is 0.036 for glass, up to 0.255 within the usual ranges"
    )

    @classmethod
    def limits(cls) -> tuple[Limit, ...]:
        kd = (0.8, 0.5, 0.2)
        return (Limit("eta = 1 without extinction is lambert", cls(kd=kd, eta=1.0), Lambert(kd=kd)),)

    def slots(self) -> dict[str, Slot]:
        geometry = {"smith": "smith_beckmann", "v_groove": "v_groove"}[self.geometry]
        diffuse = "none" if self.kd == (0.0, 0.0, 0.0) else f"under_{self.fresnel}"
        chosen = {"geometry": geometry, "fresnel": f"fresnel_{self.fresnel}", "diffuse": f"diffuse_{diffuse}"}
        return {place: Slot((f"microfacet/{name}.glsl",)) for place, name in chosen.items()}

    def asked(self, by: Literal["light", "ambient"]) -> frozenset[str]:
        return super().asked(by) - ({"kd"} if by == "light" and self.kd == (0.0, 0.0, 0.0) else set())

    def specular_part(self) -> Brdf:
        return self.without_base()

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        h, length2 = half_vector(l, v)
        a = alpha(m.roughness)
        visible = smith_beckmann(l, v, a) if m.geometry == "smith" else v_groove(l, v, h)
        lobe = np.where(length2 > 1e-12, d_beckmann(h, a) * visible, 0.0)
        # A direction below the horizon gives 0 in the end. Clamping keeps the intermediate values finite.
        NoL, NoV = np.maximum(l[..., 2], 0), np.maximum(v[..., 2], 0)
        diffuse = m.kd / math.pi * _let_through(m, NoL) * _let_through(m, NoV) * NoL[..., None]
        return above_horizon(l, v, diffuse + fresnel(m, cos_half(length2)) * lobe[..., None])

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        return m.kd  # type: ignore[no-any-return]


def _let_through(m: Any, c: Array) -> Array:
    """Returns the transmittance 1 - F (..., 3) at the cosine c (...), by the formula that the option `fresnel` names."""
    return t_conductor(m.eta, m.k, c) if m.fresnel == "exact" else t_schlick(t0_conductor(m.eta, m.k), c)
