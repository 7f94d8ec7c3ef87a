"""Workload: times a function by draws in which it runs so often that all other costs of the draw do not matter."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from glshade.driver.clock import Spread, difference, seconds
from glshade.gl.context import Context
from glshade.gl.program import Program
from glshade.gl.screen import Capture, Screen
from glshade.gl.tables import Inputs, write_inputs
from glshade.glsl.source import Source

# The side of the screen [pixels], and the number of vertices. They are large enough to occupy every unit of a large GPU, and
# small enough for a single CPU core.
SIDE = 256
VERTICES = 16384
# The number of rounds is doubled until a draw of the empty program takes this long [s], many times the cost of starting a draw.
LEAST = 2e-3
# llvmpipe ends loops after 65,535 rounds and reports nothing.
MOST_ROUNDS = 32768
# The number that is added to a direction in each round. It is so small that float32 rounds the sum to the same direction.
DRIFT = 1e-9


class Workload:
    """Draws that evaluate a model many times at each pixel or vertex (shaders/driver/evaluations.glsl).

    places: the number of pixels or vertices.
    rounds: the number of evaluations at each of them.
    without: a function that draws the empty program. Its time is subtracted from the time of the other draws.
    """

    def __init__(self, context: Context, stage: str, without: Source) -> None:
        """Chooses the number of rounds.

        stage: the stage that evaluates the model, "fragment" or "vertex".
        without: the empty program, which has an empty function in the place of the model.
        Errors: ShaderError, ContextError.
        """
        self.context, self.stage = context, stage
        in_pixels = stage == "fragment"
        self.places = SIDE * SIDE if in_pixels else VERTICES
        self._target = Screen(context, (SIDE, SIDE)) if in_pixels else Capture(context, VERTICES, 3)
        self.rounds = 16
        self.without = self._drawing(without, {})
        while self.rounds < MOST_ROUNDS and min(seconds(context, self.without) for _ in range(2)) < LEAST:
            self.rounds *= 2

    def _drawing(self, source: Source, values: Inputs) -> Callable[[], None]:
        """Returns a function that draws the program. values: name of a uniform -> its value."""
        varyings = ("v_value",) if self.stage == "vertex" else ()
        program = Program(self.context, source, varyings)
        bound = write_inputs(self.context, program, values)
        program.write("u_drift", np.full(3, DRIFT, dtype=np.float32))

        def draw() -> None:
            for unit, texture in enumerate(bound):
                texture.use(unit)
            program.set_integer("u_count", self.rounds)
            self._target.draw(program)

        return draw

    def nanoseconds(self, source: Source, values: Inputs, repeat: int) -> Spread:
        """Returns the time of one evaluation of the model [ns], as the spread of `repeat` measurements.

        source: the program with the model.
        values: name of a uniform -> its value.
        Errors: ShaderError.
        """
        spread = difference(self.context, self._drawing(source, values), self.without, repeat)
        scale = 1e9 / (self.places * self.rounds)
        return Spread(spread.median * scale, spread.low * scale, spread.high * scale)
