"""Calls a GLSL function of the shader folder by itself."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshade import Renderer
from glshade.gl.program import Program
from glshade.glsl.shaders import expand
from glshade.glsl.source import Source


def called(text: str, renderer: Renderer, a: Any, b: Any) -> NDArray[np.float32]:
    """Returns the values (N, 3) of the GLSL function `vec3 value(vec3 l, vec3 v)` at rows of a and b (N, 3), which broadcast.

    text: GLSL that defines the function; it may include shader files.
    """
    a, b = (np.ascontiguousarray(x, dtype=np.float32) for x in np.broadcast_arrays(a, b))
    context = renderer.context
    with context.gl as gl:
        program = Program(context, Source(expand("pass/evaluate.vert", {"model": text}), None), varyings=("v_value",))
        inputs = {"a_l": a, "a_v": b}
        content = [(gl.buffer(inputs[name].tobytes()), "3f", name) for name in inputs if name in program.attributes]
        result = gl.buffer(reserve=a.nbytes)
        # Without a framebuffer bound, llvmpipe writes zeros without an error.
        gl.simple_framebuffer((1, 1)).use()
        gl.vertex_array(program.gl, content).transform(result, moderngl.POINTS, vertices=len(a))
        return np.frombuffer(result.read(), dtype=np.float32).reshape(-1, 3)
