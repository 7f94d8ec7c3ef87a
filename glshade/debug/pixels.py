"""Pixels: the value of every variable at the pixels of a scene's picture, and the digits that lines of its programs lose.

The texts run on the CPU, at the points of the surfaces that the float64 reference finds.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from glshade.debug.tracing import Trace, TracedStep, paired
from glshade.errors import SceneError
from glshade.glsl.shaders import Shaders, current
from glshade.radiance.readying import ready
from glshade.radiance.surface import Surface, part_of
from glshade.reference.inputs import Inputs, prepare
from glshade.reference.visible import VisiblePart, visible_parts
from glshade.scene.models import Folders, paths, use_models
from glshade.scene.object import Rate
from glshade.scene.scene import Scene
from glshade.spirv.arithmetic import FLOAT32, FLOAT64, Arithmetic
from glshade.spirv.digits import Digits, joined
from glshade.spirv.surface import TILE, Program, surface_text
from glshade.spirv.trace import Recorder, Step

# The number of points at which the digits of an object's program are measured. A line that is bad at one of a hundred points is
# found with near certainty, and a program takes some seconds.
POINTS = 1024


@dataclass(frozen=True)
class Variable:
    """A variable of a program at one of its lines.

    place: the file and the line in it, as `file:line`.
    name: the variable with the path to the member that changes, such as `m.kd`, or `return`.
    number: how many times the line has given it a value before, as in a loop.
    """

    place: str
    name: str
    number: int = 0


@dataclass(frozen=True)
class PixelTrace(Trace):
    """The steps of the program that shades a pixel, in the order in which they ran.

    object: the name of the object that the pixel shows; None for the background, which has no steps.
    number: its index in the scene; -1 for the background.
    """

    object: str | None = None
    number: int = -1


class Pixels:
    """The visible surfaces of a scene's picture, with their programs."""

    def __init__(self, scene: Scene, shaders: Shaders, shading: Rate | None = None) -> None:
        """Computes nothing yet.

        scene: the scene.
        shaders: the shader files.
        shading: optional; replaces the shading rate of every object.
        """
        self._scene, self._shaders, self._shading = scene, shaders, shading
        # Index into the visible surfaces -> programs.
        self._programs: dict[int, tuple[Program, ...]] = {}

    def trace(self, x: int, y: int) -> PixelTrace:
        """Returns the value of every variable at a pixel, in float64 and in float32.

        x, y: column and row from the top left of the picture [pixels].
        Errors: SceneError for a pixel outside the picture; ShaderError, MissingLibrary.
        """
        height, width = self._inputs.wanted.shape
        if not (0 <= x < width and 0 <= y < height):
            raise SceneError(f"the pixel {x}, {y} lies outside the picture, which is {width} x {height}")
        for index, part in enumerate(self._visible):
            found = np.flatnonzero(part.pixel == self._inputs.wanted[y, x])
            if len(found):
                surface = part_of(part.surface, part.point[found[:1]])
                steps = tuple(step for program in self._of(index) for step in _traced(program, surface))
                return PixelTrace(steps, part.draw.instance.name, part.draw.instance.number)
        return PixelTrace(())

    def values(self, number: int, variable: Variable) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Returns the float64 values (H, W, C) of a variable at the pixels of an object, and where (H, W) there are any.

        number: the index of the object in the scene.
        C is 1 for a number, and the number of components of a vector.
        Errors: SceneError where the variable is no number and no vector, or where no pixel's program has it; ShaderError,
        MissingLibrary.
        """
        size = self._inputs.size[0] * self._inputs.size[1]
        values, present = np.zeros((size, 0)), np.zeros(size, np.bool_)
        for index in self._of_object(number):
            part = self._visible[index]
            for program in self._of(index):
                found, runs = _values(program, part.surface, variable)
                if runs.any():
                    values = values if values.shape[1] else np.zeros((size, found.shape[1]))
                    values[part.pixel], present[part.pixel] = found[part.point], runs[part.point]
                    break
        if not present.any():
            raise SceneError(f"{variable.place}: no visible program gives {variable.name} a number or a vector there")
        return values[self._inputs.wanted], present[self._inputs.wanted]

    def digits(self, number: int, seed: int = 1) -> Digits:
        """Returns the digits that the lines of an object's programs lose, at random points of its visible surface.

        number: the index of the object in the scene.
        Errors: ShaderError, MissingLibrary.
        """
        random = np.random.default_rng(seed)
        found = []
        for index in self._of_object(number):
            surface = self._visible[index].surface
            chosen = random.permutation(len(surface.position))[:POINTS]
            found += [program.digits(part_of(surface, chosen), seed) for program in self._of(index)]
        return joined(found)

    @cached_property
    def _inputs(self) -> Inputs:
        return prepare(self._scene, self._shading)

    @cached_property
    def _visible(self) -> tuple[VisiblePart, ...]:
        return tuple(visible_parts(self._inputs))

    def _of_object(self, number: int) -> list[int]:
        """Returns the indices of the visible surfaces of an object, which may consist of several meshes."""
        return [index for index, part in enumerate(self._visible) if part.draw.instance.number == number]

    def _of(self, index: int) -> tuple[Program, ...]:
        """Returns the programs of a visible surface. Errors: ShaderError, MissingLibrary."""
        if index not in self._programs:
            assembly = ready(self._scene, self._shading)
            text = surface_text(self._scene, assembly, self._visible[index].draw, self._shaders)
            self._programs[index] = text.programs
        return self._programs[index]


def trace_pixel(
    scene: Scene,
    x: int,
    y: int,
    *,
    shading: Rate | None = None,
    shaders: Folders | None = None,
    models: Folders | None = None,
) -> PixelTrace:
    """Returns the value of every variable of the program that shades a pixel, in float64 and in float32.

    x, y: column and row of the pixel, from the top left of the picture [pixels]. The program runs at the point of the surface
        that lies at the pixel's centre; with Gouraud shading, at the nearest corner of the pixel's triangle.
    shading: optional; replaces the shading rate of every object.
    shaders, models: optional; the user's shader and model folders, as for Renderer.
    Errors: SceneError, ShaderError, MissingLibrary.
    """
    use_models(models)
    return Pixels(scene, current(paths(shaders)), shading).trace(x, y)


def _traced(program: Program, surface: Surface) -> list[TracedStep]:
    """Returns the steps of a program at one point."""
    exact, single = (_recorded(program, surface, arithmetic) for arithmetic in (FLOAT64, FLOAT32))
    return [TracedStep.of(step, other) for step, other in paired(exact, single)]


def _recorded(program: Program, surface: Surface, arithmetic: Arithmetic) -> list[Step]:
    """Returns the steps of one run. Errors: ShaderError."""
    recorder = Recorder(program.module, program.stage, len(surface.position))
    program.run(surface, arithmetic, recorder.observe)
    return recorder.steps


def _values(program: Program, surface: Surface, variable: Variable) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Returns the values (N, C) of a variable at N points, and where (N,) its line runs. C is 0 where it runs nowhere."""
    points = len(surface.position)
    values, runs = np.zeros((points, 0)), np.zeros(points, np.bool_)
    # A loop runs as long as any point needs it, so each point counts for itself.
    times = np.zeros(points, np.intp)
    for start in range(0, points, TILE):
        which = slice(start, start + TILE)
        tile = part_of(surface, which)
        for step in _recorded(program, tile, FLOAT64):
            if (step.place, step.name) == (variable.place, variable.name) and step.has_picture:
                found = np.asarray(step.value, np.float64).reshape(len(tile.position), -1)
                values = values if values.shape[1] else np.zeros((points, found.shape[1]))
                here = step.running & (times[which] == variable.number)
                values[which][here], runs[which][here] = found[here], True
                times[which] += step.running
    return values, runs
