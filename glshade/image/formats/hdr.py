"""HDR: Radiance's RGBE files, linear colours of 8 bits with a common exponent, without alpha."""

from glshade.image.formats import PictureFormat


class Hdr(PictureFormat):
    """Radiance RGBE."""

    floats = True
    alpha = False
    metadata = "nowhere"
