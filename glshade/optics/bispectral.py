"""Bispectral: reads one pixel of a bispectral EXR file (Fichet, Pacanowski and Wilkie 2021)."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from glshade.errors import AssetError

Array = NDArray[np.float64]

# A channel of reradiation, such as T.350,000000nm.450,000000nm: the exciting wavelength, then the emitted one, with commas in
# place of decimal points. A channel with one wavelength holds the reflectance, and is not read.
CHANNEL = re.compile(r"T\.(\d+(?:,\d+)?)nm\.(\d+(?:,\d+)?)nm")
# The largest row of pixels that is read [bytes]. A picture 1000 pixels wide with 250 wavelengths has 125 MB a row.
LARGEST_ROW = 256 << 20


def read_pixel(path: Path, pixel: tuple[int, int]) -> tuple[Array, Array, Array]:
    """Returns the exciting wavelengths (N,) [nm], the emitted ones (M,) [nm], and the yield (N, M) [1/nm] of a pixel.

    The file holds radiance factors of bands of light, as instruments measure them: such a band is as wide as the distance of
    the wavelengths, so that a yield is a radiance factor divided by that width. Pairs without a channel have the yield 0.

    pixel: column and row, from the upper left corner.
    Errors: AssetError, in one line.
    """
    import OpenImageIO as oiio

    file = oiio.ImageInput.open(str(path))
    if file is None:
        oiio.geterror()
        raise AssetError(f"{path}: cannot be read as an EXR file")
    try:
        spec = file.spec()
        found = [(index, match) for index, name in enumerate(spec.channelnames) if (match := CHANNEL.fullmatch(name))]
        pairs = np.array([[float(word.replace(",", ".")) for word in match.groups()] for _, match in found]).reshape(-1, 2)
        column, row = pixel
        if not (0 <= column < spec.width and 0 <= row < spec.height):
            raise AssetError(f"{path}: has {spec.width} x {spec.height} pixels, and none at [{column}, {row}]")
        if spec.width * spec.nchannels * 4 > LARGEST_ROW:
            raise AssetError(f"{path}: a row of its pixels takes more than {LARGEST_ROW >> 20} MiB; cut out the pixel")
        read = None
        if len(pairs):
            top = spec.y + row
            read = file.read_scanlines(0, 0, top, top + 1, 0, 0, spec.nchannels, oiio.FLOAT)
    finally:
        file.close()
    excitation, emission = np.unique(pairs[:, 0]), np.unique(pairs[:, 1])
    if min(len(excitation), len(emission)) < 2:
        raise AssetError(f"{path}: has no bispectral channels such as T.350,000000nm.450,000000nm for two wavelengths or more")
    if read is None:
        raise AssetError(f"{path}: its pixels cannot be read")
    factors = np.zeros((len(excitation), len(emission)))
    values = np.asarray(read, dtype=np.float64).reshape(spec.width, spec.nchannels)[column]
    places = np.searchsorted(excitation, pairs[:, 0]), np.searchsorted(emission, pairs[:, 1])
    factors[places] = values[[index for index, _ in found]]
    return excitation, emission, factors / np.gradient(emission)
