"""Texture: a picture that says something of a material from place to place: a parameter, the normal, a height, a direction."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema

from glshade.document import Document, File, Finite, Triple

WrapMode = Literal["repeat", "clamp", "mirror"]
Encoding = Literal["auto", "srgb", "linear"]
_MODE = {"enum": ["repeat", "clamp", "mirror"]}
CHANNELS = "rgba"


def _pair(value: Any) -> Any:
    return (value, value) if isinstance(value, str) else value


# One mode stands for two.
Wrap = Annotated[
    tuple[WrapMode, WrapMode],
    BeforeValidator(_pair),
    WithJsonSchema({"anyOf": [_MODE, {"type": "array", "items": _MODE, "minItems": 2, "maxItems": 2}]}),
]


class Picture(Document):
    """A picture file, laid on a surface by its texture coordinates. v = 0 is its bottom row."""

    texture: File = Field(description="picture file")
    wrap: Wrap = Field(("repeat", "repeat"), description="what lies outside [0, 1], along u and along v")


class Texture(Picture):
    """A picture file, multiplied by `factor`. v = 0 is the picture's bottom row."""

    factor: Triple = Field((1.0, 1.0, 1.0), description="multiplies the picture's linear values; the first, those of a number")
    encoding: Encoding = Field(
        "auto",
        description="the file's encoding; auto: sRGB for colours held as integers, linear for floats and for scalars",
    )
    channel: Literal["r", "g", "b", "a"] | None = Field(
        None, description="of a parameter that is one number: the channel that holds it; left out: r"
    )


class NormalMap(Picture):
    """Tangent-space normals: x along the tangent (u), y along the bitangent (v), z along the normal; n = 2 rgb - 1.

    The file is taken as linear.
    """

    scale: Finite = Field(1.0, description="multiplies x and y")


class BumpMap(Picture):
    """Heights, in the red channel; the file is taken as linear. Blinn 1978: the normal turns, the surface stays where it is.

    Lengths are counted in widths of the picture (u from 0 to 1), and texels count as square: with a height of 0.1, a rise from
    black to white over a tenth of the width is a slope of 45 degrees. n is along (-dz/dx, -dz/dy, 1), z = height * red, x along
    the tangent (u), y along the bitangent (v), by central differences of the texels. A mirrored picture has mirrored slopes.
    """

    height: Finite = Field(0.05, description="how far white stands above black [widths of the picture]; negative: below")


class DirectionMap(Picture):
    """Directions along the surface, for anisotropic materials: x = 2 red - 1 along the tangent (u), y = 2 green - 1 along the
    bitangent (v), of any length; blue is ignored. The file is taken as linear.

    What is shorter than 0.01 (as are the greys 127 and 128 of 8 bits) has no direction: there the tangent is left as it is.
    """

    rotate: Finite = Field(0.0, description="turns the directions, from u toward v [degrees]")
