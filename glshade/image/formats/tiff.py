"""TIFF: the longer of the two suffixes of TIFF files."""

from glshade.image.formats.tif import Tif

Tiff = Tif
