"""InstanceBuffers: the values that differ among the instances of one draw call, which the GPU reads instance by instance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.gl.context import Context
from glshade.gl.program import Program
from glshade.glsl.uniforms import Values

# The placement changes with the viewer; everything else of an instance stays the same from view to view.
PLACEMENT = "u_world_from_object"
# A buffer, the format of one of its rows, and the names of the attributes in a row.
Content = tuple[Any, ...]


@dataclass(frozen=True, eq=False)
class InstanceBuffers:
    """The values of the instances of one draw call, in buffers.

    count: the number of instances.
    content: a buffer with the placements, and one with everything else if there is anything else.
    """

    count: int
    content: tuple[Content, ...]

    @property
    def size(self) -> int:
        """The size of the buffers [bytes]."""
        return sum(buffer.size for buffer, *_ in self.content)

    def placed(self, context: Context, placements: NDArray[np.float32]) -> InstanceBuffers:
        """Returns the same instances for another viewer.

        placements: the transforms (N, 4, 4) to positions relative to the eye.
        """
        return InstanceBuffers(self.count, (_content(context, {PLACEMENT: placements}), *self.content[1:]))


def upload(context: Context, program: Program, values: Values) -> InstanceBuffers:
    """Returns the values of N instances, uploaded.

    context: the context, which must be current.
    program: the program that reads them. It must read the placement.
    values: name -> values (N, ...) of all instances, matrices by rows. Names that the program does not read are left out.
    """
    read = {name: value for name, value in values.items() if name in program.attributes}
    placements = {PLACEMENT: read.pop(PLACEMENT)}
    content = [_content(context, placements)] + ([_content(context, read)] if read else [])
    return InstanceBuffers(len(placements[PLACEMENT]), tuple(content))


def _content(context: Context, values: Values) -> Content:
    """Returns values (N, ...) in one buffer, in which the values of one instance lie together."""
    columns = []
    for value in values.values():
        # GL stores matrices by columns.
        by_columns = value.swapaxes(1, 2) if value.ndim == 3 else value
        columns.append(by_columns.reshape(len(value), -1))
    layout = " ".join(f"{column.shape[1]}f" for column in columns)
    return context.gl.buffer(np.ascontiguousarray(np.hstack(columns))), f"{layout}/i", *values
