"""evaluate: the shader unit test. One reflectance model at given directions, on the CPU in float64 or on the GPU in float32."""

from __future__ import annotations

from typing import Any, Literal

import moderngl
import numpy as np
from numpy.typing import ArrayLike, NDArray

from glshade.brdfs import BRDFS, Brdf, numbers, widened
from glshade.gl.context import Context, open_context
from glshade.gl.program import Program
from glshade.glsl.generator import Source, expand

On = Literal["reference", "vertex", "fragment"]


def evaluate(brdf: Brdf, l: ArrayLike, v: ArrayLike, on: On = "reference", context: Context | None = None) -> NDArray[Any]:
    """f cos [1/sr] of a model, (..., 3).

    brdf: a model with its parameters, e.g. Phong(kd=0.5), none of them a texture. l, v (..., 3): unit directions to the light
    and to the viewer in the local frame (n = +z, t = +x), rounded to float32 first. on: "reference" in float64, or in the GPU's
    "vertex" (transform feedback) or "fragment" stage. context: left out, one is made for the call.
    Errors: ValueError, ContextError, ShaderError.
    """
    l, v = np.broadcast_arrays(np.asarray(l, dtype=np.float32), np.asarray(v, dtype=np.float32))
    if l.shape[-1:] != (3,):
        raise ValueError(f"l and v must have shape (..., 3), not {l.shape}")
    values = numbers(brdf)
    if on == "reference":
        result: NDArray[Any] = type(brdf).brdf_cos(widened(brdf), l.astype(np.float64), v.astype(np.float64))
        return result
    if on not in ("vertex", "fragment"):
        raise ValueError(f'on must be "reference", "vertex" or "fragment", not {on!r}')
    if l.size == 0:
        return np.zeros(l.shape, dtype=np.float32)
    opened = context or open_context()
    try:
        stage = _in_vertex_stage if on == "vertex" else _in_fragment_stage
        with opened.gl:
            flat = stage(opened, brdf, values, l.reshape(-1, 3), v.reshape(-1, 3))
        return flat.reshape(l.shape)
    finally:
        if context is None:
            opened.release()


def generated(brdf: Brdf) -> dict[str, str]:
    """The model's include, its uniforms, and `value(l, v)`."""
    struct = BRDFS.class_name(brdf.brdf)
    text = f'#include "brdf/{brdf.brdf}.glsl"\n'
    names = list(brdf.parameters())
    for name in names:
        text += f"uniform {'vec3' if brdf.is_colour(name) else 'float'} u_{name};\n"
    arguments = ", ".join(f"u_{name}" for name in names)
    frame = "Frame(vec3(0.0, 0.0, 1.0), vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0))"
    text += f"\nvec3 value(vec3 l, vec3 v) {{\n    return brdf_cos({struct}({arguments}), {frame}, l, v);\n}}\n"
    return {**brdf.slots(), "model": text}


def _in_vertex_stage(
    context: Context, brdf: Brdf, values: dict[str, NDArray[np.float32]], l: NDArray[Any], v: NDArray[Any]
) -> NDArray[np.float32]:
    source = Source(expand("pass/evaluate.vert", generated(brdf)), None)
    program = Program(context, source, varyings=("v_value",))
    for name, value in values.items():
        program.write(f"u_{name}", value)
    gl = context.gl
    names = [name for name in ("a_l", "a_v") if name in program.attributes]
    content = [(gl.buffer({"a_l": l, "a_v": v}[name].tobytes()), "3f", name) for name in names]
    result = gl.buffer(reserve=l.nbytes)
    # Without a framebuffer bound, llvmpipe writes zeros and says nothing.
    gl.simple_framebuffer((1, 1)).use()
    gl.vertex_array(program.gl, content).transform(result, moderngl.POINTS, vertices=len(l))
    return np.frombuffer(result.read(), dtype=np.float32).reshape(-1, 3)


def _in_fragment_stage(
    context: Context, brdf: Brdf, values: dict[str, NDArray[np.float32]], l: NDArray[Any], v: NDArray[Any]
) -> NDArray[np.float32]:
    source = Source(expand("pass/picture.vert", {}), expand("pass/evaluate.frag", generated(brdf)))
    program = Program(context, source)
    for name, value in values.items():
        program.write(f"u_{name}", value)
    gl = context.gl
    width = min(len(l), 4096)
    height = -(-len(l) // width)
    for unit, (name, directions) in enumerate((("u_l", l), ("u_v", v))):
        padded = np.zeros((width * height, 4), dtype=np.float32)
        padded[: len(l), :3] = directions
        texture = gl.texture((width, height), 4, padded.tobytes(), dtype="f4")
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        texture.use(unit)
        program.set_integer(name, unit)
    target = gl.framebuffer([gl.texture((width, height), 4, dtype="f4")])
    target.use()
    gl.enable_only(moderngl.NOTHING)
    gl.vertex_array(program.gl, []).render(moderngl.TRIANGLES, vertices=3)
    out = np.empty((height, width, 4), dtype=np.float32)
    target.read_into(out, components=4, dtype="f4")
    return out.reshape(-1, 4)[: len(l), :3]
