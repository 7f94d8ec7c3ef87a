"""JPEG: the longer of the two suffixes of JPEG files."""

from glshade.image.formats.jpg import Jpg

Jpeg = Jpg
