"""Texture: a picture that gives a material's parameter its value from place to place."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema

from glshade.document import Document, File, Finite, Triple

WrapMode = Literal["repeat", "clamp", "mirror"]
_MODE = {"enum": ["repeat", "clamp", "mirror"]}


def _pair(value: Any) -> Any:
    return (value, value) if isinstance(value, str) else value


# One mode stands for two.
Wrap = Annotated[
    tuple[WrapMode, WrapMode],
    BeforeValidator(_pair),
    WithJsonSchema({"anyOf": [_MODE, {"type": "array", "items": _MODE, "minItems": 2, "maxItems": 2}]}),
]


class Texture(Document):
    """A picture file, multiplied by `factor`. v = 0 is the picture's bottom row."""

    texture: File = Field(description="picture file")
    factor: Triple = Field((1.0, 1.0, 1.0), description="multiplies the picture's linear values")
    encoding: Literal["auto", "srgb", "linear"] = Field(
        "auto",
        description="the file's encoding; auto: sRGB for colours held as integers, linear for floats and for scalars",
    )
    wrap: Wrap = Field(("repeat", "repeat"), description="what lies outside [0, 1], along u and along v")


class NormalMap(Document):
    """Tangent-space normals: x along the tangent (u), y along the bitangent (v), z along the normal; n = 2 rgb - 1."""

    texture: File = Field(description="picture file, linear")
    scale: Finite = Field(1.0, description="multiplies x and y")
    wrap: Wrap = Field(("repeat", "repeat"), description="what lies outside [0, 1], along u and along v")
