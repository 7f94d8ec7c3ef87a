"""lafortune: up to three cosine lobes in any directions over a diffuse base."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from glshade.brdfs import Array, Brdf, Colour, Limit, Parameter, Scalar, Slot, above_horizon, parameter
from glshade.brdfs.lambert import Lambert
from glshade.brdfs.minnaert import Minnaert
from glshade.brdfs.phong_normalised import PhongNormalised
from glshade.brdfs.retro_phong import RetroPhong
from glshade.textures.texture import Texture

LOBES = (1, 2, 3)


class Lafortune(Brdf):
    """(kd/pi + sum of ks_i (p_i + 2)/(2 pi) max(cx_i lx vx + cy_i ly vy + cz_i lz vz, 0)^p_i) n.l with p_i = exponent_i.

    It is reciprocal, and anisotropic where cx differs from cy. C = (cx, cy, cz) = (-1, -1, 1) gives the mirror lobe of
    phong_normalised, (1, 1, 1) gives retro_phong, and (0, 0, 1) gives minnaert. A smaller |cz| moves the peak away from the
    mirror direction, towards the horizon. Each |c| is at most 1: so the base of the power is at most 1, and a lobe reflects at
    most ks_i. In published lobes C holds the strength too: with c the largest |C| of such a lobe, use C/c and ks = 2 pi c^p /
    (p + 2). The default is one mirror lobe. A lobe with ks_i = 0 costs nothing. The model reflects ambient light with kd.
    """

    source: ClassVar[str] = "Lafortune, Foo, Torrance and Greenberg 1997"
    shares: ClassVar[tuple[str, ...]] = ("kd", "ks_1", "ks_2", "ks_3")
    isotropic_where: ClassVar[dict[str, str | float]] = {"cy_1": "cx_1", "cy_2": "cx_2", "cy_3": "cx_3"}
    samples: ClassVar[tuple[Mapping[str, Any], ...]] = (
        {"exponent_1": 10},
        {"exponent_1": 100},
        {"cx_1": -1, "cz_1": 0.7, "exponent_1": 10},
        {"cx_1": 1, "exponent_1": 10},
    )
    linear: ClassVar[tuple[str, ...]] = ("kd", "ks_1", "ks_2", "ks_3")

    brdf: Literal["lafortune"] = "lafortune"
    kd: Colour = parameter((0.5, 0.5, 0.5), Parameter("diffuse reflectance", base=True))
    ks_1: Colour = parameter((0.3, 0.3, 0.3), Parameter("reflectance of lobe 1"))
    cx_1: Scalar = parameter(
        -1.0,
        Parameter(
            "factor of lobe 1 along the tangent; -1: mirror lobe, 1: back to the light", low=-1.0, high=1.0, usual=(-1.0, 1.0)
        ),
    )
    cy_1: Scalar | None = parameter(
        None,
        Parameter("factor of lobe 1 along the bitangent; default: cx_1", low=-1.0, high=1.0, usual=(-1.0, 1.0), same_as="cx_1"),
    )
    cz_1: Scalar = parameter(1.0, Parameter("factor of lobe 1 along the normal", low=-1.0, high=1.0, usual=(-1.0, 1.0)))
    exponent_1: Scalar = parameter(32.0, Parameter("narrowness of lobe 1, p", high=1e8, usual=(1.0, 1000.0)))
    ks_2: Colour = parameter((0.0, 0.0, 0.0), Parameter("reflectance of lobe 2"))
    cx_2: Scalar = parameter(
        -1.0,
        Parameter(
            "factor of lobe 2 along the tangent; -1: mirror lobe, 1: back to the light", low=-1.0, high=1.0, usual=(-1.0, 1.0)
        ),
    )
    cy_2: Scalar | None = parameter(
        None,
        Parameter("factor of lobe 2 along the bitangent; default: cx_2", low=-1.0, high=1.0, usual=(-1.0, 1.0), same_as="cx_2"),
    )
    cz_2: Scalar = parameter(1.0, Parameter("factor of lobe 2 along the normal", low=-1.0, high=1.0, usual=(-1.0, 1.0)))
    exponent_2: Scalar = parameter(32.0, Parameter("narrowness of lobe 2, p", high=1e8, usual=(1.0, 1000.0)))
    ks_3: Colour = parameter((0.0, 0.0, 0.0), Parameter("reflectance of lobe 3"))
    cx_3: Scalar = parameter(
        -1.0,
        Parameter(
            "factor of lobe 3 along the tangent; -1: mirror lobe, 1: back to the light", low=-1.0, high=1.0, usual=(-1.0, 1.0)
        ),
    )
    cy_3: Scalar | None = parameter(
        None,
        Parameter("factor of lobe 3 along the bitangent; default: cx_3", low=-1.0, high=1.0, usual=(-1.0, 1.0), same_as="cx_3"),
    )
    cz_3: Scalar = parameter(1.0, Parameter("factor of lobe 3 along the normal", low=-1.0, high=1.0, usual=(-1.0, 1.0)))
    exponent_3: Scalar = parameter(32.0, Parameter("narrowness of lobe 3, p", high=1e8, usual=(1.0, 1000.0)))

    @classmethod
    def limits(cls) -> tuple[Limit, ...]:
        kd, ks = (0.8, 0.5, 0.2), (0.1, 0.2, 0.3)
        none, half = (0.0, 0.0, 0.0), (0.05, 0.1, 0.15)
        mirror = PhongNormalised(kd=kd, ks=ks, exponent=50.0)
        # The power is computed from differences of l and v, which assumes unit vectors. Rounding to float32 changes their
        # lengths by 6e-8, and the value by p times that.
        rounded = 2e-6
        return (
            Limit("ks_i = 0 is lambert", cls(kd=kd, ks_1=none), Lambert(kd=kd)),
            Limit("C = (-1, -1, 1) is phong_normalised", cls(kd=kd, ks_1=ks, exponent_1=50.0), mirror),
            Limit("two halves of a lobe are one", cls(kd=kd, ks_1=half, ks_2=half, exponent_1=50.0, exponent_2=50.0), mirror),
            Limit(
                "C = (1, 1, 1) is retro_phong",
                cls(kd=kd, ks_1=ks, cx_1=1.0, cz_1=1.0, exponent_1=50.0),
                RetroPhong(kd=kd, ks=ks, exponent=50.0),
            ),
            Limit(
                "C = (0, 0, 1) is minnaert with k = p + 1",
                cls(kd=none, ks_1=ks, cx_1=0.0, cz_1=1.0, exponent_1=1.5),
                Minnaert(kd=ks, k=2.5),
                rounded,
            ),
            Limit("cy is cx by default", cls(cx_1=-0.75), cls(cx_1=-0.75, cy_1=-0.75)),
        )

    def canonical(self, ambient: bool) -> Brdf:
        if self._lobes():
            return self
        surface = {name: getattr(self, name) for name in Brdf.model_fields if name != "brdf"}
        return Lambert.model_construct(brdf="lambert", kd=self.kd, **surface)

    def _lobes(self) -> tuple[int, ...]:
        """Returns the numbers of the lobes that are not black."""
        return tuple(i for i in LOBES if getattr(self, f"ks_{i}") != (0.0, 0.0, 0.0))

    @property
    def needs_tangents(self) -> bool:
        pairs = [(getattr(self, f"cx_{i}"), getattr(self, f"cy_{i}")) for i in self._lobes()]
        return any(y is not None and (isinstance(x, Texture) or x != y) for x, y in pairs)

    def asked(self, by: Literal["light", "ambient"]) -> frozenset[str]:
        absent = set(LOBES) - set(self._lobes())
        unasked = {f"{name}_{i}" for i in absent for name in ("ks", "cx", "cy", "cz", "exponent")}
        # An isotropic program reads cx for both axes.
        return super().asked(by) - unasked - ({f"cy_{i}" for i in LOBES} if not self.needs_tangents else set())

    def slots(self) -> dict[str, Slot]:
        axes = "anisotropic" if self.needs_tangents else "isotropic"
        lobe = "    sum += m.ks_{0} * lobe(x, vec3(m.cx_{0}, m.cy_{0}, m.cz_{0}), m.exponent_{0});\n"
        body = "".join(lobe.format(i) for i in self._lobes())
        return {
            "axes": Slot((f"surface/axes_{axes}.glsl",)),
            "lobes": Slot(text=f"vec3 lobes(Lafortune m, Axes x) {{\n    vec3 sum = vec3(0.0);\n{body}    return sum;\n}}\n"),
        }

    def specular_part(self) -> Brdf:
        return self.without_base()

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        total = m.kd / math.pi
        for i in LOBES:
            ks, *c, p = (getattr(m, f"{name}_{i}") for name in ("ks", "cx", "cy", "cz", "exponent"))
            lobe = (p + 2) / (2 * math.pi) * power_of_product(np.stack(np.broadcast_arrays(*c), axis=-1), l, v, p)
            total = total + ks * lobe[..., None]
        return above_horizon(l, v, total * l[..., 2:])

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        return m.kd  # type: ignore[no-any-return]


def power_of_product(c: Array, l: Array, v: Array, p: Array) -> Array:
    """Returns max(cx lx vx + cy ly vy + cz lz vz, 0)^p (...) for unit l, v (..., 3) and |c| <= 1 (..., 3); 0^0 gives 0."""
    size = np.abs(c)
    base = np.sum(c * l * v, axis=-1)
    # s is 1 - base, written as a sum of terms that are not negative, so that no digits cancel.
    s = 0.5 * np.sum(size * (l - np.sign(c) * v) ** 2 + (1 - size) * (l * l + v * v), axis=-1)
    with np.errstate(divide="ignore"):
        log_base = np.where(s < 0.5, np.log1p(-np.minimum(s, 0.5)), np.log(np.clip(base, np.finfo(base.dtype).tiny, 1)))
    return np.where((s < 0.5) | (base > 0), np.exp(p * log_base), 0.0)
