"""Models: nineteen reflectance models, written from docs/brdfs.md.

A model is a function of its parameters m and of a Place. m holds colours (N, 3) and numbers (N, 1) by name. The function
returns f cos (N, 3) [1/sr] for a light and a viewer above the horizon.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from support.third.vectors import Array, dot, unit

PI = math.pi
Parameters = Mapping[str, Array]
# The default, the lowest and the highest value of a parameter. A name in place of the default stands for that parameter.
Range = tuple[float | tuple[float, ...] | str, float, float]
# Cosines below this one count as this one where a model divides by them.
GRAZING = 2.0**-20


@dataclass(frozen=True)
class Place:
    """Points of a surface with the directions at them, unit vectors (N, 3).

    n: the normal, on the side that is seen.
    t: the tangent.
    b: the bitangent.
    l: the direction to the light.
    v: the direction to the viewer.
    """

    n: Array
    t: Array
    b: Array
    l: Array
    v: Array

    @cached_property
    def nl(self) -> Array:
        return dot(self.n, self.l)

    @cached_property
    def nv(self) -> Array:
        return dot(self.n, self.v)

    @cached_property
    def h(self) -> Array:
        return unit(self.l + self.v)

    @cached_property
    def nh(self) -> Array:
        return dot(self.n, self.h)

    @cached_property
    def lh(self) -> Array:
        return dot(self.l, self.h)

    @cached_property
    def mirrored(self) -> Array:
        """The cosine r.v of the angle between the mirror direction of the light and the viewer."""
        return np.maximum(2 * self.nl * self.nv - dot(self.l, self.v), 0)


def schlick(f0: Array, c: Array) -> Array:
    """Returns Schlick's reflectance for the cosine c."""
    return f0 + (1 - f0) * (1 - c) ** 5


def conductor(m: Parameters, c: Array) -> Array:
    """Returns Fresnel's reflectance of the index eta + i k for unpolarised light, for the cosine c."""
    index = m["eta"] + 1j * m["k"]
    inside = np.sqrt(1 - (1 - c * c) / index**2)
    s = (c - index * inside) / (c + index * inside)
    p = (index * c - inside) / (index * c + inside)
    return (np.abs(s) ** 2 + np.abs(p) ** 2) / 2


def width(m: Parameters) -> Array:
    return np.maximum(m["roughness"], 0.01) ** 2


def ggx_lobe(m: Parameters, p: Place) -> Array:
    """Returns D G2 / (4 n.v) of the distribution GGX with Smith's height-correlated shadowing."""
    aspect = np.sqrt(1 - 0.9 * m["anisotropy"])
    ax, ay = width(m) / aspect, width(m) * aspect
    d = 1 / (PI * ax * ay * ((dot(p.h, p.t) / ax) ** 2 + (dot(p.h, p.b) / ay) ** 2 + p.nh**2) ** 2)

    def hidden(w: Array) -> Array:
        slope2 = ((ax * dot(w, p.t)) ** 2 + (ay * dot(w, p.b)) ** 2) / dot(w, p.n) ** 2
        return (np.sqrt(1 + slope2) - 1) / 2

    return d / (1 + hidden(p.l) + hidden(p.v)) / (4 * p.nv)


def lambert(m: Parameters, p: Place) -> Array:
    return m["kd"] / PI * p.nl


def phong(m: Parameters, p: Place) -> Array:
    return (m["kd"] * p.nl + m["ks"] * p.mirrored ** m["exponent"]) / PI


def phong_normalised(m: Parameters, p: Place) -> Array:
    e = m["exponent"]
    return (m["kd"] / PI + m["ks"] * (e + 2) / (2 * PI) * p.mirrored**e) * p.nl


def blinn_phong(m: Parameters, p: Place) -> Array:
    return (m["kd"] * p.nl + m["ks"] * np.maximum(p.nh, 0) ** m["exponent"]) / PI


def blinn_phong_normalised(m: Parameters, p: Place) -> Array:
    e = m["exponent"]
    scale = (e + 2) * (e + 4) / (8 * PI * (2 ** (-e / 2) + e))
    return (m["kd"] / PI + m["ks"] * scale * np.maximum(p.nh, 0) ** e) * p.nl


def retro_phong(m: Parameters, p: Place) -> Array:
    e = m["exponent"]
    return (m["kd"] / PI + m["ks"] * (e + 2) / (2 * PI) * np.maximum(dot(p.l, p.v), 0) ** e) * p.nl


def minnaert(m: Parameters, p: Place) -> Array:
    product = np.maximum(p.nl, GRAZING) * np.maximum(p.nv, GRAZING)
    return m["kd"] * (m["k"] + 1) / (2 * PI) * product ** (m["k"] - 1) * p.nl


def burley(m: Parameters, p: Place) -> Array:
    rise = 2 * m["roughness"] * p.lh**2 - 0.5
    return m["kd"] / PI * (1 + rise * (1 - p.nl) ** 5) * (1 + rise * (1 - p.nv) ** 5) * p.nl


def azimuth(p: Place) -> Array:
    """Returns the cosine of the angle between the azimuths of l and v."""
    l, v = unit(p.l - p.n * p.nl), unit(p.v - p.n * p.nv)
    return np.clip(dot(l, v), -1, 1)


def oren_nayar(m: Parameters, p: Place) -> Array:
    """Oren and Nayar 1994, equations 27 to 30."""
    angles = np.arccos(np.clip(np.concatenate([p.nl, p.nv], axis=1), 0, 1))
    a, b = angles.max(axis=1, keepdims=True), angles.min(axis=1, keepdims=True)
    s2, c = m["sigma"] ** 2, azimuth(p)
    c1 = 1 - 0.5 * s2 / (s2 + 0.33)
    c2 = 0.45 * s2 / (s2 + 0.09) * np.where(c >= 0, np.sin(a), np.sin(a) - (2 * b / PI) ** 3)
    c3 = 0.125 * s2 / (s2 + 0.09) * (4 * a * b / PI**2) ** 2
    once = m["kd"] * (c1 + c * c2 * np.tan(b) + (1 - np.abs(c)) * c3 * np.tan((a + b) / 2))
    twice = 0.17 * m["kd"] ** 2 * s2 / (s2 + 0.13) * (1 - c * (2 * b / PI) ** 2)
    return np.maximum((once + twice) / PI * p.nl, 0)


def oren_nayar_qualitative(m: Parameters, p: Place) -> Array:
    angles = np.arccos(np.clip(np.concatenate([p.nl, p.nv], axis=1), 0, 1))
    a, b = angles.max(axis=1, keepdims=True), angles.min(axis=1, keepdims=True)
    s2 = m["sigma"] ** 2
    first, second = 1 - s2 / 2 / (s2 + 0.33), 0.45 * s2 / (s2 + 0.09)
    return m["kd"] / PI * (first + second * np.maximum(azimuth(p), 0) * np.sin(a) * np.tan(b)) * p.nl


def ashikhmin_shirley(m: Parameters, p: Place) -> Array:
    """Ashikhmin and Shirley 2000, equations 1 to 5, with h in the exponent."""
    across = m["pu"] * dot(p.h, p.t) ** 2 + m["pv"] * dot(p.h, p.b) ** 2
    sin2 = np.maximum(1 - p.nh**2, 1e-300)
    scale = np.sqrt((m["pu"] + 1) * (m["pv"] + 1)) / (8 * PI * p.lh * np.maximum(p.nl, p.nv))
    lobe = scale * p.nh ** (across / sin2) * schlick(m["ks"], p.lh)
    base = 28 / (23 * PI) * m["kd"] * (1 - m["ks"]) * (1 - (1 - p.nl / 2) ** 5) * (1 - (1 - p.nv / 2) ** 5)
    return (base + lobe) * p.nl


def beckmann(m: Parameters, p: Place) -> Array:
    """Cook and Torrance's model with Smith's height-correlated shadowing (Heitz 2014, equation 99) and Fresnel's formula."""
    a = width(m)
    tan2 = (1 - p.nh**2) / p.nh**2
    d = np.exp(-tan2 / a**2) / (PI * a**2 * p.nh**4)
    erf = np.vectorize(math.erf, otypes=[np.float64])

    def hidden(c: Array) -> Array:
        x = c / (a * np.sqrt(np.maximum(1 - c * c, 1e-12)))
        return (erf(x) - 1) / 2 + np.exp(-(x**2)) / (2 * x * math.sqrt(PI))

    lobe = conductor(m, p.lh) * d / (1 + hidden(p.nl) + hidden(p.nv)) / (4 * p.nv)
    return m["kd"] / PI * (1 - conductor(m, p.nl)) * (1 - conductor(m, p.nv)) * p.nl + lobe


def ggx(m: Parameters, p: Place) -> Array:
    f = schlick(m["f0"] * (1 - m["metallic"]) + m["kd"] * m["metallic"], p.lh)
    return m["kd"] * (1 - m["metallic"]) / PI * (1 - f) * p.nl + f * ggx_lobe(m, p)


def metal(m: Parameters, p: Place) -> Array:
    return conductor(m, p.lh) * ggx_lobe(m, p)


def lafortune(m: Parameters, p: Place) -> Array:
    result = m["kd"] / PI
    for i in "123":
        pairs = ((p.t, m[f"cx_{i}"]), (p.b, m[f"cy_{i}"]), (p.n, m[f"cz_{i}"]))
        product = sum(c * dot(axis, p.l) * dot(axis, p.v) for axis, c in pairs)
        e = m[f"exponent_{i}"]
        result = result + m[f"ks_{i}"] * (e + 2) / (2 * PI) * np.maximum(product, 0) ** e
    return result * p.nl


def gaussian(m: Parameters, p: Place) -> tuple[Array, Array, Array]:
    """Returns exp(-slope^2), H and H.n of ward's models, with H = l + v."""
    big = p.l + p.v
    height = np.maximum(dot(big, p.n), GRAZING)
    slope2 = ((dot(big, p.t) / m["alpha_x"]) ** 2 + (dot(big, p.b) / m["alpha_y"]) ** 2) / height**2
    return np.exp(-slope2), big, height


def ward(m: Parameters, p: Place) -> Array:
    lobe, _, _ = gaussian(m, p)
    below = 4 * PI * m["alpha_x"] * m["alpha_y"] * np.sqrt(np.maximum(p.nl, GRAZING) * np.maximum(p.nv, GRAZING))
    return (m["kd"] / PI + m["ks"] * lobe / below) * p.nl


def ward_duer(m: Parameters, p: Place) -> Array:
    lobe, _, _ = gaussian(m, p)
    below = 4 * PI * m["alpha_x"] * m["alpha_y"] * np.maximum(p.nl, GRAZING) * np.maximum(p.nv, GRAZING)
    return (m["kd"] / PI + m["ks"] * lobe / below) * p.nl


def ward_gmd(m: Parameters, p: Place) -> Array:
    lobe, big, height = gaussian(m, p)
    below = PI * m["alpha_x"] * m["alpha_y"] * height**4
    return (m["kd"] / PI + m["ks"] * lobe * dot(big, big) / below) * p.nl


@dataclass(frozen=True)
class Model:
    """A reflectance model.

    f_cos: returns f cos (N, 3) [1/sr].
    colours: the parameters that are colours, by name.
    numbers: the parameters that are numbers, by name.
    ambient: returns the share (N, 3) of ambient light that is reflected.
    base: the name of the base colour, which vertex colours multiply.
    """

    f_cos: Callable[[Parameters, Place], Array]
    colours: dict[str, Range]
    numbers: dict[str, Range] = field(default_factory=dict)
    ambient: Callable[[Parameters], Array] = lambda m: m["kd"]
    base: str = "kd"

    @property
    def anisotropic(self) -> bool:
        """Whether f cos depends on the direction of the tangent."""
        return bool({"pv", "alpha_y", "anisotropy", "cy_1"} & set(self.numbers))


INF = math.inf
EXPONENT: Range = (32.0, 0.0, 1e8)
KA: Range = ("kd", 0.0, INF)
WARD: dict[str, Range] = {"kd": (0.4, 0.0, INF), "ks": (0.2, 0.0, INF)}
SLOPES: dict[str, Range] = {"alpha_x": (0.15, 1e-4, 1.0), "alpha_y": ("alpha_x", 1e-4, 1.0)}
ROUGH: dict[str, Range] = {"roughness": (0.5, 0.0, 1.0), "anisotropy": (0.0, 0.0, 1.0)}
GOLD: dict[str, Range] = {"eta": ((0.1239, 0.3805, 1.541), 0.01, 100.0), "k": ((4.834, 2.196, 1.676), 0.0, 100.0)}
SIGMA: dict[str, Range] = {"sigma": (0.3, 0.0, 1.5708)}


def _lobe(i: int) -> dict[str, Range]:
    return {
        f"cx_{i}": (-1.0, -1.0, 1.0),
        f"cy_{i}": (f"cx_{i}", -1.0, 1.0),
        f"cz_{i}": (1.0, -1.0, 1.0),
        f"exponent_{i}": EXPONENT,
    }


MODELS: dict[str, Model] = {
    "ambient": Model(lambda m, p: 0 * p.n, {"ka": (0.8, 0.0, INF)}, {}, lambda m: m["ka"], "ka"),
    "ashikhmin_shirley": Model(
        ashikhmin_shirley,
        {"kd": (0.5, 0.0, 1.0), "ks": (0.05, 0.0, 1.0)},
        {"pu": (100.0, 0.0, 1e8), "pv": (100.0, 0.0, 1e8)},
    ),
    "beckmann": Model(
        beckmann,
        {"kd": (0.5, 0.0, 1.0), "eta": (1.5, 0.01, 100.0), "k": (0.0, 0.0, 100.0)},
        {"roughness": (0.5, 0.0, 1.0)},
    ),
    "blinn_phong": Model(
        blinn_phong,
        {"kd": (0.8, 0.0, INF), "ks": (0.2, 0.0, INF), "ka": KA},
        {"exponent": (128.0, 0.0, 1e8)},
        lambda m: m["ka"],
    ),
    "blinn_phong_normalised": Model(
        blinn_phong_normalised, {"kd": (0.5, 0.0, INF), "ks": (0.3, 0.0, INF)}, {"exponent": (128.0, 0.0, 1e8)}
    ),
    "burley": Model(burley, {"kd": (0.8, 0.0, 1.0)}, {"roughness": (0.5, 0.0, 1.0)}),
    "ggx": Model(ggx, {"kd": (0.5, 0.0, 1.0), "f0": (0.04, 0.0, 1.0)}, ROUGH | {"metallic": (0.0, 0.0, 1.0)}),
    "lafortune": Model(
        lafortune,
        {"kd": (0.5, 0.0, INF), "ks_1": (0.3, 0.0, INF), "ks_2": (0.0, 0.0, INF), "ks_3": (0.0, 0.0, INF)},
        _lobe(1) | _lobe(2) | _lobe(3),
    ),
    "lambert": Model(lambert, {"kd": (0.8, 0.0, INF)}),
    "metal": Model(
        metal, GOLD, ROUGH | {"roughness": (0.3, 0.0, 1.0)}, lambda m: conductor(m, np.ones_like(m["roughness"])), ""
    ),
    "minnaert": Model(minnaert, {"kd": (0.5, 0.0, INF)}, {"k": (0.7, 0.0, 10.0)}),
    "oren_nayar": Model(oren_nayar, {"kd": (0.8, 0.0, 1.0)}, SIGMA),
    "oren_nayar_qualitative": Model(oren_nayar_qualitative, {"kd": (0.8, 0.0, 1.0)}, SIGMA),
    "phong": Model(phong, {"kd": (0.8, 0.0, INF), "ks": (0.2, 0.0, INF), "ka": KA}, {"exponent": EXPONENT}, lambda m: m["ka"]),
    "phong_normalised": Model(phong_normalised, {"kd": (0.5, 0.0, INF), "ks": (0.3, 0.0, INF)}, {"exponent": EXPONENT}),
    "retro_phong": Model(retro_phong, {"kd": (0.3, 0.0, INF), "ks": (0.5, 0.0, INF)}, {"exponent": EXPONENT}),
    "ward": Model(ward, WARD, SLOPES),
    "ward_duer": Model(ward_duer, WARD, SLOPES),
    "ward_gmd": Model(ward_gmd, WARD, SLOPES),
}
