"""Texture: the pictures that let a material vary over a surface: its parameters, normals, heights or directions."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema

from glshade.document import Document, File, Finite, Triple

WrapMode = Literal["repeat", "clamp", "mirror"]
Encoding = Literal["auto", "srgb", "linear"]
_MODE = {"enum": ["repeat", "clamp", "mirror"]}
CHANNELS = "rgba"


def _pair(value: Any) -> Any:
    return (value, value) if isinstance(value, str) else value


# Two wrap modes, along u and along v; the scene file may give one mode in place of two equal ones.
Wrap = Annotated[
    tuple[WrapMode, WrapMode],
    BeforeValidator(_pair),
    WithJsonSchema({"anyOf": [_MODE, {"type": "array", "items": _MODE, "minItems": 2, "maxItems": 2}]}),
]


class Picture(Document):
    """A picture file that is placed on a surface by texture coordinates. v = 0 is its bottom row."""

    texture: File = Field(description="picture file")
    wrap: Wrap = Field(("repeat", "repeat"), description="how the picture continues outside [0, 1], along u and along v")


class Texture(Picture):
    """A picture file whose values are multiplied by `factor`. v = 0 is the picture's bottom row."""

    factor: Triple = Field(
        (1.0, 1.0, 1.0), description="multiplies the linear values; a parameter that is one number takes the first"
    )
    encoding: Encoding = Field(
        "auto",
        description="encoding of the file; auto: sRGB for colours stored as integers, linear for floats and for single numbers",
    )
    channel: Literal["r", "g", "b", "a"] | None = Field(
        None, description="channel that is read for a parameter that is one number; left out: r"
    )


class NormalMap(Picture):
    """A map of tangent-space normals n = 2 rgb - 1: x along the tangent (u), y along the bitangent (v), z along the normal.

    The file is read as linear. Only the mapped normal decides whether a point faces a light. So light from behind a face may
    leak through it where the mapped normal leans toward the light; bump maps and smooth normals leak in the same way.
    """

    scale: Finite = Field(1.0, description="multiplies x and y of the normals")


class BumpMap(Picture):
    """A map of heights in the red channel, which turn the normals but do not move the surface (Blinn 1978).

    The file is read as linear. Lengths are counted in widths of the picture (u from 0 to 1), and texels count as square: with a
    height of 0.1, a rise from black to white over a tenth of the width is a slope of 45 degrees. The normal is along
    (-dz/dx, -dz/dy, 1) with z = height * red, x along the tangent (u) and y along the bitangent (v). The slopes are central
    differences of the texels. A mirrored picture has mirrored slopes.
    """

    height: Finite = Field(0.05, description="height of white above black, which may be negative [widths of the picture]")


class DirectionMap(Picture):
    """A map of directions along the surface, for anisotropic materials.

    A direction has x = 2 red - 1 along the tangent (u) and y = 2 green - 1 along the bitangent (v). Its length does not matter,
    and blue is ignored. The file is read as linear. A vector shorter than 0.01, such as the 8-bit greys 127 and 128, counts as
    no direction: the tangent stays as it is.
    """

    rotate: Finite = Field(0.0, description="angle by which the directions are turned, from u toward v [degrees]")
