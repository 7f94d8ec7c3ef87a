"""RGL: files of the material database of EPFL's Realistic Graphics Lab (Dupuy and Jakob 2018), which are refused by name."""

from __future__ import annotations

from glshade.measured.formats import MeasuredFile, MeasuredFormat
from glshade.measured.samples import Grid

# The first bytes of the container in which the database stores its arrays.
MAGIC = b"tensor_file\0"


class Bsdf(MeasuredFormat):
    """Files of the RGL database, which end in .bsdf. They hold no samples over fixed angles, but warped ones."""

    def recognises(self, data: bytes) -> bool:
        return data.startswith(MAGIC)

    def read(self, file: MeasuredFile) -> Grid:
        raise file.fail(
            "is a .bsdf file of the RGL material database, whose adaptive parametrisation is not read; "
            "evaluate it at a grid of angles and save the values as ALTA text"
        )
