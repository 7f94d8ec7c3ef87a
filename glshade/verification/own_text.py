"""Own text: lets the reference run the GLSL of a scene's programs in place of the models' Python functions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from difflib import SequenceMatcher
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.assembly.assembly import Assembly
from glshade.errors import MissingLibrary, NoReference, ShaderError
from glshade.glsl.shaders import Shaders, current
from glshade.glsl.source import Stage
from glshade.radiance.draw import Draw
from glshade.radiance.readying import ready
from glshade.radiance.surface import Surface, evaluate_surface, part_of
from glshade.reference.bounds import AGAIN, narrowed
from glshade.reference.inputs import Inputs
from glshade.reference.visible import visible_parts
from glshade.scene.object import Rate
from glshade.scene.scene import Scene

Array = NDArray[Any]

# The number of points of an object at which its GLSL and its model's Python function are compared.
POINTS = 2048
# The difference that is allowed between them, relative to the brightest point: the constants in the GLSL are float32 numbers.
ALLOWED = 1e-5


def with_text(scene: Scene, inputs: Inputs, shading: Rate | None, every: bool, shaders: Shaders | None) -> Inputs:
    """Returns the inputs of the reference, with the GLSL of the objects whose models have no Python function.

    every: True to run the GLSL of all objects.
    shaders: optional; the shader files. Default: those that ship with glshade.
    Errors: ShaderError; NoReference where a model has only its GLSL and glslangValidator is not installed; MissingLibrary where
    only `every` asks for the GLSL.
    """
    chosen = [every or not draw.model.has_reference for draw in inputs.draws]
    if not any(chosen):
        return inputs
    from glshade.spirv.surface import surface_text

    assembly, files = ready(scene, shading), shaders or current()
    draws = []
    for draw, is_chosen in zip(inputs.draws, chosen, strict=True):
        if not is_chosen:
            draws.append(draw)
            continue
        try:
            draws.append(replace(draw, text=surface_text(scene, assembly, draw, files)))
        except MissingLibrary as error:
            if draw.model.has_reference:
                raise
            raise NoReference(
                f"the model {draw.instance.material.brdf!r} has only its GLSL, which is run to verify its pictures, and {error}"
            ) from None
    return replace(inputs, draws=tuple(draws))


def differences(scene: Scene, inputs: Inputs, shading: Rate | None, shaders: Shaders | None) -> Iterator[str]:
    """Yields a sentence for each object whose GLSL and whose model's Python function differ by more than rounding explains.

    The sentence names the line that makes the difference, where the GLSL differs from the one that ships with glshade.
    inputs: as `with_text` returns them.
    shaders: the shader files whose GLSL was run.
    Errors: ShaderError, MissingLibrary.
    """
    assembly = ready(scene, shading)
    for part in visible_parts(inputs):
        draw = part.draw
        if draw.text is None or not draw.model.has_reference:
            continue
        step = -(-len(part.surface.position) // POINTS)
        surface = part_of(part.surface, slice(None, None, step))
        twin = evaluate_surface(replace(draw, text=None), surface)
        allowed = _allowed(draw, surface, twin)
        difference = np.abs(evaluate_surface(draw, surface) - twin)
        beyond = difference > allowed
        if beyond.any():
            line = _line(scene, assembly, draw, surface, twin, allowed, shaders)
            differing, largest = int(np.count_nonzero(beyond.any(axis=1))), float(difference[beyond].max())
            yield (
                f"the GLSL of {draw.instance.name} and the Python function of its model, {draw.instance.material.brdf}, differ "
                f"at {differing} of {len(twin)} points, by up to {largest:.1e}{line}"
            )


def _allowed(draw: Draw, surface: Surface, twin: Array) -> Array:
    """Returns the difference (N, 3) between a text and its twin that rounding explains."""
    assert draw.text is not None
    rounding = np.abs(draw.text(narrowed(surface)) - draw.text(surface))
    return np.asarray(ALLOWED * max(float(np.abs(twin).max(initial=0.0)), 1e-6) + AGAIN * rounding)


def _line(
    scene: Scene, assembly: Assembly, draw: Draw, surface: Surface, twin: Array, allowed: Array, shaders: Shaders | None
) -> str:
    """Returns the end of a sentence, with the lines that make the difference; empty where they are not known."""
    from glshade.spirv.arithmetic import FLOAT64
    from glshade.spirv.compiler import compiled
    from glshade.spirv.surface import SurfaceText, surface_text

    text = draw.text
    if not isinstance(text, SurfaceText) or shaders is None:
        return ""
    try:
        shipped = surface_text(scene, assembly, draw, current())
    except ShaderError:
        return ""
    used, right = text.programs[0], shipped.programs[0]
    changed = list(_changes(used.stage, right.stage))
    blamed = []
    for number, (place, _) in enumerate(changed):
        others = [change for index, (_, change) in enumerate(changed) if index != number]
        try:
            # All other changes are taken back: what is left is what this one does.
            stage = _patched(used.stage, right.stage, others)
            program = replace(used, stage=stage, module=compiled(stage, used.module.stage))
        except ShaderError:
            continue
        if (np.abs(program.run(surface, FLOAT64) - twin) > allowed).any():
            blamed.append(place)
    return f"; the line that makes the difference is {' or '.join(blamed)}" if blamed else ""


Change = tuple[int, int, int, int]


def _changes(used: Stage, right: Stage) -> Iterator[tuple[str, Change]]:
    """Yields the place of each changed run of lines, and the change.

    The change is (first, end) of the run in the text that was used, and (first, end) in the right one.
    """
    lines, others = used.text.splitlines(), right.text.splitlines()
    for kind, first, end, start, stop in SequenceMatcher(None, lines, others, autojunk=False).get_opcodes():
        if kind != "equal":
            yield used.place(first + 1), (first, end, start, stop)


def _patched(used: Stage, right: Stage, changes: list[Change]) -> Stage:
    """Returns the text that was used, with some changes taken back. Its lines keep no places."""
    lines, others = used.text.splitlines(), right.text.splitlines()
    for first, end, start, stop in sorted(changes, reverse=True):
        lines[first:end] = others[start:stop]
    return Stage("\n".join(lines) + "\n", tuple(("changed text", number) for number in range(1, len(lines) + 1)))
