"""Tables: uploads the tables that models read, as textures of three dimensions with half floats."""

from __future__ import annotations

from collections.abc import Mapping

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshade.errors import SceneError
from glshade.gl.context import Context
from glshade.gl.program import Program
from glshade.textures.volume import Volume

# Name -> value of the uniforms of a program, some of which are tables.
Inputs = Mapping[str, NDArray[np.float32] | Volume]
# The bytes of a texel. Drivers add a fourth half float to the three, so that texels are aligned.
TEXEL = 8


def upload_table(context: Context, volume: Volume) -> moderngl.Texture3D:
    """Returns a texture with the texels of a table and with linear filtering.

    context: the context, which must be current.
    volume: the table.
    Errors: SceneError for a table that is larger than the driver allows.
    """
    largest = int(context.gl.info["GL_MAX_3D_TEXTURE_SIZE"])
    if max(volume.size) > largest:
        raise SceneError(f"a table of {' x '.join(map(str, volume.size))} texels: this driver allows {largest} along each side")
    result = context.gl.texture3d(volume.size, 3, volume.texels.tobytes(), dtype="f2")
    result.filter = (moderngl.LINEAR, moderngl.LINEAR)
    result.repeat_x, result.repeat_y, result.repeat_z = (end == "repeat" for end in volume.ends)
    return result


def write_inputs(context: Context, program: Program, values: Inputs, first: int = 0) -> list[moderngl.Texture3D]:
    """Sets uniforms of a program. Returns the textures of its tables, which live as long as the caller wants.

    values: name -> value of the uniforms, some of which may be tables.
    first: the texture unit of the first table; the others follow.
    Errors: SceneError for a table that is larger than the driver allows.
    """
    textures: list[moderngl.Texture3D] = []
    for name, value in values.items():
        if isinstance(value, Volume):
            unit = first + len(textures)
            textures.append(upload_table(context, value))
            textures[-1].use(unit)
            program.set_integer(name, unit)
        else:
            program.write(name, value)
    return textures
