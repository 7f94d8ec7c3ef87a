"""measured: reflectance that was measured, read from a file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from glshade.brdfs import BLACK, Array, Brdf, Colour, Parameter, Slot, above_horizon, parameter
from glshade.document import File
from glshade.textures.volume import Volume

if TYPE_CHECKING:
    from glshade.measured.table import Table

# The file of a material that names none. script/make-assets writes it.
SAMPLE = Path(__file__).parent.parent / "measured" / "sample.binary"

# The direction about which the half vector is taken: l, or for retro-reflective data its mirror image, which turns the half
# vector into the back vector.
_ARRIVING = "vec3 arriving(Frame f, vec3 l, float NoL) {{\n    return {};\n}}"
# The coordinate in the table, from 0 to 1, of an azimuth. x and y have the signs of its cosine and its sine, and u is its angle
# from the nearer end of the axis of x, in units of a right angle.
_AZIMUTH = "float azimuth(float u, float x, float y) {{\n    return {};\n}}"
_HALF_TURN = "x * y >= 0.0 ? 0.5 * u : 1.0 - 0.5 * u"
_WHOLE_TURN = "x >= 0.0 ? (y >= 0.0 ? 0.25 * u : 1.0 - 0.25 * u) : 0.5 + (y >= 0.0 ? -0.25 * u : 0.25 * u)"


class Measured(Brdf):
    """scale f(theta_h, theta_d, phi_d) n.l, where f is read from a table that is made of the measured values.

    theta_h is the angle between n and h, theta_d the angle between l and h, and phi_d the azimuth of l about h, 0 where l leans
    away from n. The table holds log2 f in half floats, at even steps of sqrt(theta_h), theta_d and phi_d, and is read with
    trilinear filtering. For retro-reflective data, l is mirrored at n first, which turns h into the back vector. Only isotropic
    data can be drawn. Values are drawn as they were measured, also where their errors let a surface reflect more light than
    arrives; whether f(l, v) and f(v, l) may differ is up to `reciprocity`. The ambient reflectance ka is given by hand, because
    f says nothing about it.
    """

    source: ClassVar[str] = "Matusik et al. 2003; Rusinkiewicz 1998"
    shares: ClassVar[tuple[str, ...]] = ("scale",)
    linear: ClassVar[tuple[str, ...]] = ("scale", "ka")
    samples: ClassVar[tuple[Mapping[str, Any], ...]] = (
        {"scale": 1.0},
        {"scale": (1.0, 0.4, 0.2)},
        {"scale": (0.3, 0.7, 1.0)},
        {"scale": 0.3},
    )
    tables: ClassVar[Mapping[str, str]] = {"reflectance": "file"}

    brdf: Literal["measured"] = "measured"
    scale: Colour = parameter((1.0, 1.0, 1.0), Parameter("multiplies the measured values", usual=(0.0, 2.0), base=True))
    ka: Colour = parameter(BLACK, Parameter("ambient reflectance"))
    file: File | None = Field(
        None,
        description="file of measured values: Cornell's .brdf, MERL's .binary or ALTA's text; left out: a blue lacquer that "
        "ships with glshade",
    )
    reciprocity: Literal["kept", "enforced"] = Field(
        "kept",
        description="kept: f(l, v) and f(v, l) stay as they were measured; enforced: their geometric mean replaces both",
    )

    def measured(self) -> Table:
        """Returns the table of the file, from a cache. Errors: AssetError."""
        # Most scenes have no measured material, so the readers of files are imported here.
        from glshade.measured.file import load

        return load(self.file or SAMPLE, self.reciprocity)

    @property
    def is_handed(self) -> bool:
        # A mirror changes the sign of phi_d, and with that reverses the order of the cells.
        values = self.measured().values
        return not np.array_equal(values, values[::-1])

    def table(self, name: str) -> Volume:
        return _volume(self.measured())

    def data(self) -> dict[str, Any]:
        found = self.measured()
        return {"reflectance": _volume(found), "turn": found.turn, "retro": found.retro}

    def notes(self) -> tuple[str, ...]:
        return self.measured().notes

    def slots(self) -> dict[str, Slot]:
        found = self.measured()
        turn = _HALF_TURN if found.turn < 1.5 * math.pi else _WHOLE_TURN
        arriving = "2.0 * NoL * f.n - l" if found.retro else "l"
        return {"arriving": Slot(text=_ARRIVING.format(arriving)), "azimuth": Slot(text=_AZIMUTH.format(turn))}

    def asked(self, by: Literal["light", "ambient"]) -> frozenset[str]:
        return frozenset({"scale"} if by == "light" else {"ka"})

    def specular_part(self) -> Brdf:
        return self

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        f = np.exp2(m.reflectance.sample(coordinates(l, v, m.turn, m.retro)))
        return above_horizon(l, v, m.scale * f * l[..., 2:])

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        return m.ka  # type: ignore[no-any-return]


@lru_cache(maxsize=16)
def _volume(table: Table) -> Volume:
    """Returns a table as it is uploaded, the same object for the same table."""
    return table.volume()


def coordinates(l: Array, v: Array, turn: float, retro: bool) -> Array:
    """Returns the texture coordinates (..., 3) of two directions in a table, in the type of the directions.

    l, v: unit directions (..., 3) to the light and to the viewer, in the local frame.
    turn: the angle after which the table repeats along phi_d, pi or 2 pi.
    retro: whether the table holds retro-reflective data.
    """
    i = l * np.array([-1, -1, 1], l.dtype) if retro else l
    # h and q are perpendicular, and half their lengths are cosine and sine of theta_d.
    h, q = i + v, i - v
    length = np.linalg.norm(h, axis=-1)
    theta_d = np.arctan2(np.linalg.norm(q, axis=-1), length)
    theta_h = np.arctan2(np.hypot(h[..., 0], h[..., 1]), np.maximum(h[..., 2], 0))
    # A turn about n that takes h into the plane of x and z, and one about y that takes h to z, leave q without z. These are the
    # components of q then, multiplied by |h| sin(theta_h). The second turn takes q.z to x, because q.h is 0.
    x, y = -q[..., 2] * length, h[..., 0] * q[..., 1] - h[..., 1] * q[..., 0]
    angles = [np.sqrt(theta_h * (2 / math.pi)), theta_d * (2 / math.pi), np.arctan2(y, x) / turn]
    return np.stack(angles, axis=-1).astype(l.dtype)
