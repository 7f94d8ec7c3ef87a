"""Texture: the pictures that let a material vary over a surface: its parameters, normals, heights or directions."""

import math
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, PlainSerializer, Tag, WithJsonSchema

from glshade.document import AsIs, Document, File, Finite, Triple, fault
from glshade.image.file import Encoding
from glshade.textures.pixel_array import PixelArray

WrapMode = Literal["repeat", "clamp", "mirror"]
Filter = Literal["smooth", "nearest"]
# The two rows of the matrix from a mesh's texture coordinates (u, v, 1) to a picture's.
Placement = tuple[tuple[float, float, float], tuple[float, float, float]]
UNPLACED: Placement = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
# The least and the largest scale of texture coordinates. A repeat of a millionth of the mesh is far smaller than a pixel, and
# the bounds of a picture's colours need a matrix that can be inverted.
SMALLEST_SCALE, LARGEST_SCALE = 1e-6, 1e6
_MODE = {"enum": ["repeat", "clamp", "mirror"]}
CHANNELS = "rgba"


def _pair(value: Any) -> Any:
    return (value, value) if isinstance(value, str | int | float) else value


def _scale(value: tuple[float, float]) -> tuple[float, float]:
    if not all(SMALLEST_SCALE <= abs(x) <= LARGEST_SCALE for x in value):
        raise fault(f"must be from {SMALLEST_SCALE:g} to {LARGEST_SCALE:g}, or the negative of that, not {list(value)}")
    return value


# Two wrap modes, along u and along v; the scene file may give one mode in place of two equal ones.
Wrap = Annotated[
    tuple[WrapMode, WrapMode],
    BeforeValidator(_pair),
    WithJsonSchema({"anyOf": [_MODE, {"type": "array", "items": _MODE, "minItems": 2, "maxItems": 2}]}),
]
_NUMBER = {"type": "number"}
# Two numbers, along u and along v; the scene file may give one number in place of two equal ones.
Scale = Annotated[
    tuple[Finite, Finite],
    AfterValidator(_scale),
    BeforeValidator(_pair),
    WithJsonSchema({"anyOf": [_NUMBER, {"type": "array", "items": _NUMBER, "minItems": 2, "maxItems": 2}]}),
]


def _pixels(value: Any) -> Any:
    """Returns a PixelArray for an array, and other values as they are."""
    if not isinstance(value, np.ndarray):
        return value
    try:
        return PixelArray.of(value)
    except ValueError as error:
        raise fault(str(error)) from None


def _source_branch(value: Any) -> str:
    """Returns the tag of the union branch that validates the value. The tags are those of `document.BRANCHES`."""
    return "<value>" if isinstance(value, PixelArray) else "<texture-table>"


# A picture file or, in Python, an array of pixels.
PictureSource = Annotated[
    Annotated[PixelArray, AsIs(), Tag("<value>")] | Annotated[File, Tag("<texture-table>")],
    Discriminator(_source_branch),
    PlainSerializer(lambda value: value.digest if isinstance(value, PixelArray) else str(value), when_used="json"),
    WithJsonSchema({"type": "string", "format": "path"}),
]


class Picture(Document):
    """A picture that is placed on a surface by texture coordinates. v = 0 is its bottom row.

    It is a file or, in Python, a NumPy array of pixels, as `PixelArray.of` takes it. The picture is read at
    uv_offset + turned(uv_scale * uv), where uv are the mesh's texture coordinates.
    """

    texture: Annotated[PictureSource, BeforeValidator(_pixels)] = Field(description="picture file")
    wrap: Wrap = Field(("repeat", "repeat"), description="how the picture continues outside [0, 1], along u and along v")
    filter: Filter = Field(
        "smooth",
        description="between the texels of a magnified picture: smooth, or nearest, where each texel is a square of one colour",
    )
    uv_scale: Scale = Field((1.0, 1.0), description="multiplies the texture coordinates u and v, so that the picture repeats")
    uv_rotate: Finite = Field(0.0, description="angle by which these coordinates are turned, from u toward v [degrees]")
    uv_offset: tuple[Finite, Finite] = Field(
        (0.0, 0.0), description="moves texture coordinates that are scaled and turned [sizes of the picture]"
    )

    @property
    def placement(self) -> Placement:
        """The rows of the matrix from texture coordinates (u, v, 1) to those at which the picture is read."""
        angle = math.radians(self.uv_rotate % 360)
        # Without the rounding, a quarter turn would have a cosine of 6e-17.
        cos, sin = round(math.cos(angle), 15), round(math.sin(angle), 15)
        (su, sv), (ou, ov) = self.uv_scale, self.uv_offset
        return (cos * su, -sin * sv, ou), (sin * su, cos * sv, ov)


class Texture(Picture):
    """A picture file whose values are multiplied by `factor`, and to which `add` is then added. v = 0 is its bottom row."""

    factor: Triple = Field(
        (1.0, 1.0, 1.0), description="multiplies the linear values; a parameter that is one number takes the first"
    )
    add: Triple = Field(
        (0.0, 0.0, 0.0), description="is added after the factor; with factor -1, an add of 1 turns gloss into roughness"
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


class OcclusionMap(Picture):
    """A map of how open each point of a surface is to light from all around it: 1 in the open, 0 in a closed crevice.

    The file is read as linear, and values outside [0, 1] are clamped to it. Ambient light is multiplied by
    1 + strength (x - 1), as in glTF 2.0, section 3.9.3; light from a direction and emission stay as they are.
    """

    channel: Literal["r", "g", "b", "a"] = Field("r", description="channel that is read")
    strength: Annotated[float, Field(ge=0, le=1)] = Field(1.0, description="0: no effect; 1: the full effect")
