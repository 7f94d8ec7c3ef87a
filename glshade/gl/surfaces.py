"""Surfaces: what is seen in every pixel: its depth, and the object that it belongs to."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshade.assembly import Instance, assemble
from glshade.camera import window
from glshade.gl.renderer import TILE, Renderer
from glshade.plan import ProgramPlan, plan_instance
from glshade.scene import Scene
from glshade.source import Source, _alpha, _alpha_inputs, expand
from glshade.texels import Texels, texels
from glshade.uniforms import object_uniforms, rounded

Surfaces = tuple[NDArray[np.float32], NDArray[np.int32]]


def surfaces(renderer: Renderer, scene: Scene) -> Surfaces:
    """(depth (H, W), number (H, W)) at the middle of every pixel, row 0 at the top; its context is current.

    depth: along the view axis [scene units], 0 where nothing is. number: of the scene's objects, which one; -1 where nothing
    is. A cut-out has holes; a blended surface counts as solid. Errors: SceneError, ShaderError.
    """
    context = renderer.context
    assembly = assemble(scene)
    view = assembly.view
    whole = view.clip_from_world(context.zero_to_one)
    forward = rounded(-view.axes[2])
    draws = []
    for instance in assembly.instances:
        # As under flat shading, the vertex stage hands on what alpha needs and nothing else.
        plan = replace(plan_instance(instance, assembly, "linear"), rate="flat")
        program = renderer._program(_source(plan))
        vertices = renderer._vertices.array(instance.mesh, program)
        values = object_uniforms(plan, instance, view.eye) | {"u_number": rounded(instance.number + 1), "u_forward": forward}
        draws.append((instance, program, vertices, values, _alpha_texture(plan, instance)))
    width, height = scene.film.size
    depth = np.empty((height, width), dtype=np.float32)
    number = np.empty((height, width), dtype=np.int32)
    side = min(TILE, context.largest_side)
    for x in range(0, width, side):
        for y in range(0, height, side):
            size = (min(side, width - x), min(side, height - y))
            clip = rounded(window(whole, scene.film.size, x, y, *size))
            frame = renderer._frame(size, "rgba32f", 1)
            frame.begin((0.0, 0.0, 0.0, 0.0))
            context.gl.enable_only(moderngl.DEPTH_TEST)
            for instance, program, vertices, values, picture in draws:
                program.write("u_clip_from_world", clip)
                for name, value in values.items():
                    program.write(name, value)
                if picture is not None:
                    name, wanted = picture
                    renderer._texture(wanted).use(0)
                    program.set_integer(name, 0)
                renderer._set_state(False, False, not instance.back_faces, instance.mirrored)
                vertices.render()
            pixels: NDArray[Any] = np.empty((size[1], size[0], 4), dtype=np.float32)
            frame.readback(pixels)
            depth[y : y + size[1], x : x + size[0]] = pixels[..., 0]
            number[y : y + size[1], x : x + size[0]] = pixels[..., 1].astype(np.int32) - 1
    return depth, number


def _source(plan: ProgramPlan) -> Source:
    vertex = {"surface": _alpha_inputs(plan, "out")}
    fragment = {"surface": _alpha_inputs(plan, "in") + _alpha(plan)}
    return Source(expand("pass/surface.vert", vertex), expand("pass/surface.frag", fragment))


def _alpha_texture(plan: ProgramPlan, instance: Instance) -> tuple[str, Texels] | None:
    name = plan.alpha_from
    return (f"u_{name}_texture", texels(instance.material, name)) if name else None
