"""Baking: the values of a material as a file of measured reflectance."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from glshade.arrays import Float64
from glshade.brdfs import Brdf, widened
from glshade.errors import GlshadeError
from glshade.files import replacing
from glshade.measured.formats import binary, brdf
from glshade.measured.rusinkiewicz import directions
from glshade.measured.samples import Grid, Samples, lit_from_x
from glshade.measured.table import MERL_SIZE, above_horizon, grid

# The formats that are written.
SUFFIXES = (".binary", ".brdf")
# A file of single samples has this number of angles theta_h, and a square grid of difference directions with this number of
# columns: the polar coordinates of a point of the grid are theta_d and phi_d. Other numbers hold for a surface with a grain,
# which is turned to TURNS azimuths.
COLUMNS_H, COLUMNS_D, TURNED_H, TURNED_D, TURNS = 40, 28, 20, 12, 8


def check_suffix(path: Path) -> None:
    """Checks that a material can be written to a file with the suffix of `path`. Errors: GlshadeError."""
    if path.suffix.lower() not in SUFFIXES:
        raise GlshadeError(
            f"{path}: a material is baked into {' or '.join(SUFFIXES)}, not {path.suffix or 'a file without suffix'}"
        )


def write(material: Brdf, path: Path, comment: str = "") -> None:
    """Writes the values of a material to a file, whole or not at all.

    path: a file that ends in .binary, for materials without a grain, or .brdf.
    comment: one line for the head of a .brdf file.
    Errors: GlshadeError, where the format cannot hold the material, or the file cannot be written. ValueError for a texture.
    """
    check_suffix(path)
    if path.suffix.lower() == ".brdf":
        data = brdf.written(baked_samples(material), comment or f"glshade, {material.brdf}").encode()
    elif material.needs_tangents:
        raise GlshadeError(
            f"{path}: a .binary file has no azimuth of the surface, on which this material depends; write a .brdf"
        )
    else:
        data = binary.written(baked_grid(material).f)
    try:
        with replacing(path) as temporary:
            temporary.write_bytes(data)
    except OSError as error:
        raise GlshadeError(f"{path}: cannot be written: {error.strerror}") from None


def baked_grid(material: Brdf, size: tuple[int, int, int] = MERL_SIZE) -> Grid:
    """Returns the reflectance of a material without a grain in the cells of the MERL database.

    Such cells have no room for a difference between f(l, v) and f(v, l): they hold the mean.
    Errors: ValueError for a texture.
    """
    theta_h, theta_d, phi_d = np.broadcast_arrays(*grid(size, math.pi))
    f = np.full((*size, 3), np.nan)
    for layer in range(size[0]):
        above = above_horizon(theta_h[layer], theta_d[layer], phi_d[layer])
        l, v = directions(theta_h[layer][above], theta_d[layer][above], phi_d[layer][above])
        value = reflectance(material, l, v)
        f[layer][above] = (value + reflectance(material, v, l)) / 2 if "reciprocity" in material.breaks else value
    return Grid(f)


def baked_samples(material: Brdf) -> Samples:
    """Returns the reflectance of a material at scattered directions. Errors: ValueError for a texture."""
    turned = material.needs_tangents
    height, width, turns = (TURNED_H, TURNED_D, TURNS) if turned else (COLUMNS_H, COLUMNS_D, 1)
    along = math.pi / 2 * ((np.arange(width) + 0.5) / width * 2 - 1)
    x, y, h = (axis.ravel() for axis in np.meshgrid(along, along, (np.arange(height) + 0.5) / height))
    theta_h, theta_d, phi_d = math.pi / 2 * h * h, np.hypot(x, y), np.arctan2(y, x)
    above = (theta_d < math.pi / 2) & above_horizon(theta_h, theta_d, phi_d)
    l, v = lit_from_x(*directions(theta_h[above], theta_d[above], phi_d[above]))
    turn = 2 * math.pi * np.arange(turns) / turns
    l, v = (np.concatenate([_turned(side, angle) for angle in turn]) for side in (l, v))
    return Samples(l, v, reflectance(material, l, v))


def _turned(directions: Float64, angle: float) -> Float64:
    c, s = math.cos(angle), math.sin(angle)
    result: Float64 = directions @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return result


def reflectance(material: Brdf, l: Float64, v: Float64) -> Float64:
    """Returns f (N, 3) [1/sr] of a material at directions (N, 3) above the horizon. Errors: ValueError for a texture."""
    f_cos = type(material).brdf_cos(widened(material), l, v)
    result: Float64 = np.broadcast_to(f_cos, l.shape) / l[:, 2:]
    return result
