"""MERL binary: the format of the MERL database, which holds cells over theta_h, theta_d and phi_d (Matusik et al. 2003).

Three little-endian int32 give the numbers of cells along theta_h, theta_d and phi_d; then follow the cells of red, of green and
of blue as float64. phi_d varies fastest and theta_h slowest. phi_d runs from 0 to pi, because the data are reciprocal. A
negative number stands for a cell that was not measured, such as those below the horizon.
"""

from __future__ import annotations

import numpy as np

from glshade.arrays import Float64
from glshade.measured.formats import MeasuredFile, MeasuredFormat
from glshade.measured.samples import Grid
from glshade.measured.table import MERL_SIZE

# The header of the database's own files, which have 90, 90 and 180 cells along theta_h, theta_d and phi_d.
MERL_HEADER = np.array(MERL_SIZE[::-1], dtype="<i4").tobytes()
HEADER_SIZE = len(MERL_HEADER)
# What the numbers of red, green and blue are multiplied by [1/sr].
SCALES = np.array([1.0, 1.15, 1.66]) / 1500.0
# The most cells along one angle. The database's own files have 180.
MOST_CELLS = 256


class Binary(MeasuredFormat):
    """Files of the MERL database, which end in .binary. Other numbers of cells than the database's own are read, too."""

    description = ".binary (MERL)"

    def recognises(self, data: bytes) -> bool:
        return data.startswith(MERL_HEADER)

    def read(self, file: MeasuredFile) -> Grid:
        if len(file.data) < HEADER_SIZE:
            raise file.fail(f"has {len(file.data)} bytes, fewer than a header of {HEADER_SIZE}; is it cut short?")
        counts: list[int] = np.frombuffer(file.data[:HEADER_SIZE], dtype="<i4").tolist()
        if not all(1 <= count <= MOST_CELLS for count in counts):
            given = ", ".join(map(str, counts))
            raise file.fail(
                f"begins with {given} in place of three numbers of cells from 1 to {MOST_CELLS}, as MERL's 90, 90, 180"
            )
        size = HEADER_SIZE + 8 * 3 * int(np.prod(counts))
        if len(file.data) != size:
            raise file.fail(f"has {len(file.data):,} bytes in place of {size:,}; is it cut short?")
        planes = np.frombuffer(file.data, dtype="<f8", offset=HEADER_SIZE).reshape(3, *counts)
        f = np.empty((*counts[::-1], 3))
        for channel, (plane, scale) in enumerate(zip(planes, SCALES, strict=True)):
            if not np.isfinite(plane).all():
                cell = int(np.argmin(np.isfinite(plane)))
                raise file.fail(f"number {channel * plane.size + cell + 1} after the header is not a finite number")
            f[..., channel] = plane.T * scale
        f[(f < 0).any(axis=-1)] = np.nan
        return Grid(f)


def written(f: Float64) -> bytes:
    """Returns the bytes of a file. f: (P, D, H, 3) [1/sr], NaN in cells below the horizon, which become -1."""
    header = np.array(f.shape[2::-1], dtype="<i4").tobytes()
    planes = [np.where(np.isnan(f[..., k]), -1.0, f[..., k] / SCALES[k]).T.astype("<f8").tobytes() for k in range(3)]
    return header + b"".join(planes)
