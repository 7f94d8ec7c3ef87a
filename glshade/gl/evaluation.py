"""Evaluation: `evaluate`, which computes one reflectance model at given directions, on the CPU or in a stage on the GPU."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import moderngl
import numpy as np
from numpy.typing import ArrayLike, NDArray

from glshade.brdfs import Brdf, widened
from glshade.gl.context import Context, open_context
from glshade.gl.program import Program
from glshade.gl.tables import Inputs, write_inputs
from glshade.glsl.generator import value_code
from glshade.glsl.shaders import Shaders, current, expand
from glshade.glsl.source import Code, Rewrite, Source
from glshade.glsl.uniforms import model_inputs
from glshade.scene.models import Folders, paths, use_models

On = Literal["reference", "text", "vertex", "fragment"]


def evaluate(
    brdf: Brdf,
    l: ArrayLike,
    v: ArrayLike,
    on: On = "reference",
    context: Context | None = None,
    *,
    shaders: Folders | None = None,
    models: Folders | None = None,
) -> NDArray[Any]:
    """Returns the values f cos (..., 3) of a model [1/sr], where f is its BRDF and cos the cosine between the normal and l.

    brdf: a model with its parameters, for example Phong(kd=0.5); none of them may be a texture.
    l: unit directions (..., 3) to the light, of any leading shape, in the local frame, where the normal is +z and the tangent
        is +x. They are first rounded to float32.
    v: unit directions (..., 3) to the viewer in the same frame, rounded in the same way. l and v are broadcast to one shape.
    on: "reference" for the model's Python function in float64; "text" for its GLSL in float64, run without a GPU; "vertex" or
        "fragment" for its GLSL in float32 in that stage on the GPU.
    context: optional; the context to use. Default: a new one for this call.
    shaders: optional; the user's shader folders, as for Renderer.
    models: optional; the user's model folders, as for Renderer.
    Errors: ValueError, ContextError, ShaderError, SceneError; MissingLibrary where `on` is "text" and glslangValidator is not
    installed.
    """
    use_models(models)
    l, v = np.broadcast_arrays(np.asarray(l, dtype=np.float32), np.asarray(v, dtype=np.float32))
    if l.shape[-1:] != (3,):
        raise ValueError(f"l and v must have shape (..., 3), not {l.shape}")
    values = model_inputs(brdf)
    if on == "reference":
        result: NDArray[Any] = type(brdf).brdf_cos(widened(brdf), l.astype(np.float64), v.astype(np.float64))
        return result
    if on == "text":
        from glshade.spirv.model import evaluate_text

        return evaluate_text(brdf, l.reshape(-1, 3), v.reshape(-1, 3), current(paths(shaders))).reshape(l.shape)
    if on not in ("vertex", "fragment"):
        raise ValueError(f'on must be "reference", "text", "vertex" or "fragment", not {on!r}')
    if l.size == 0:
        return np.zeros(l.shape, dtype=np.float32)
    opened = context or open_context()
    try:
        pair, files = (l.reshape(-1, 3), v.reshape(-1, 3)), current(paths(shaders))
        return run_on_gpu(opened, on, value_code(brdf), values, *pair, files).reshape(l.shape)
    finally:
        if context is None:
            opened.release()


def run_on_gpu(
    context: Context,
    on: Literal["vertex", "fragment"],
    code: Mapping[str, Code | str],
    values: Inputs,
    l: NDArray[Any],
    v: NDArray[Any],
    shaders: Shaders,
    rewrite: Rewrite = lambda source: source,
) -> NDArray[np.float32]:
    """Returns the values (N, 3) of a function of two directions, run in float32 in a stage on the GPU.

    code: place -> code; the place `model` defines `vec3 value(vec3 l, vec3 v)`.
    values: name -> value of the uniforms, which may be tables.
    l, v: the directions (N, 3).
    rewrite: optional; changes the text before it is compiled.
    Errors: ShaderError.
    """
    if on == "vertex":
        source = Source(expand("pass/evaluate.vert", code, shaders), None)
    else:
        source = Source(expand("pass/picture.vert", {}, shaders), expand("pass/evaluate.frag", code, shaders))
    stage = _in_vertex_stage if on == "vertex" else _in_fragment_stage
    with context.gl:
        result = stage(context, rewrite(source), values, l.astype(np.float32), v.astype(np.float32))
        # This frees the program, textures and buffers of the call.
        context.gl.gc()
    return result


def _in_vertex_stage(context: Context, source: Source, values: Inputs, l: NDArray[Any], v: NDArray[Any]) -> NDArray[np.float32]:
    program = Program(context, source, varyings=("v_value",))
    bound = write_inputs(context, program, values)
    gl = context.gl
    names = [name for name in ("a_l", "a_v") if name in program.attributes]
    content = [(gl.buffer({"a_l": l, "a_v": v}[name].tobytes()), "3f", name) for name in names]
    result = gl.buffer(reserve=l.nbytes)
    # Without a bound framebuffer, llvmpipe captures zeros and reports no error.
    gl.simple_framebuffer((1, 1)).use()
    gl.vertex_array(program.gl, content).transform(result, moderngl.POINTS, vertices=len(l))
    del bound
    return np.frombuffer(result.read(), dtype=np.float32).reshape(-1, 3)


def _in_fragment_stage(
    context: Context, source: Source, values: Inputs, l: NDArray[Any], v: NDArray[Any]
) -> NDArray[np.float32]:
    program = Program(context, source)
    # Textures on the first two units hold the directions.
    bound = write_inputs(context, program, values, first=2)
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
    del bound
    return out.reshape(-1, 4)[: len(l), :3]
