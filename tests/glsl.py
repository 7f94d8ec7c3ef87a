"""GLSL functions of the shader folder, called by themselves."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshade import Renderer
from glshade.gl.program import Program
from glshade.glsl.generator import Source, expand


def called(text: str, renderer: Renderer, a: Any, b: Any) -> NDArray[np.float32]:
    """(N, 3): `vec3 value(vec3 l, vec3 v)` of the GLSL `text`, includes and all, at the rows of a and b (N, 3)."""
    a, b = (np.ascontiguousarray(x, dtype=np.float32) for x in np.broadcast_arrays(a, b))
    context = renderer.context
    with context.gl as gl:
        program = Program(context, Source(expand("pass/evaluate.vert", {"model": text}), None), varyings=("v_value",))
        inputs = {"a_l": a, "a_v": b}
        content = [(gl.buffer(inputs[name].tobytes()), "3f", name) for name in inputs if name in program.attributes]
        result = gl.buffer(reserve=a.nbytes)
        # Without a framebuffer bound, llvmpipe writes zeros and says nothing.
        gl.simple_framebuffer((1, 1)).use()
        gl.vertex_array(program.gl, content).transform(result, moderngl.POINTS, vertices=len(a))
        return np.frombuffer(result.read(), dtype=np.float32).reshape(-1, 3)
