"""Workload: a program drawn so often that its time is that of the function in the middle of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import moderngl
import numpy as np

from glshade.driver.clock import Spread, difference, seconds
from glshade.gl.context import Context
from glshade.gl.program import Program
from glshade.glsl.generator import Source

# A square of pixels, and as many vertices: enough for every unit of a large GPU, little enough for one core.
SIDE = 256
VERTICES = 16384
# The rounds are doubled until a draw of the program that is taken off takes this long [s]: many times what starting one takes.
LEAST = 2e-3
# llvmpipe stops loops after 65,535 rounds, without a word.
MOST_ROUNDS = 32768
# Added to a direction each round; float32 does not notice.
DRIFT = 1e-9


class Workload:
    """One stage, "fragment" or "vertex": draws with many evaluations at each place (shaders/lib/evaluations.glsl).

    without: the program that is taken off the others' times. rounds: evaluations a pixel or vertex.
    """

    def __init__(self, context: Context, stage: str, without: Source) -> None:
        self.context, self.stage = context, stage
        gl = context.gl
        self.places = SIDE * SIDE if stage == "fragment" else VERTICES
        # Without a framebuffer bound, llvmpipe's vertex stage writes zeros and says nothing.
        self.target = gl.framebuffer([gl.texture((SIDE, SIDE), 4, dtype="f4")])
        self.captured = gl.buffer(reserve=12 * VERTICES)
        self.without = self._drawing(without, {})
        self.rounds = 16
        while self.rounds < MOST_ROUNDS and min(seconds(context, self.without) for _ in range(2)) < LEAST:
            self.rounds *= 2

    def _drawing(self, source: Source, values: Mapping[str, Any]) -> Callable[[], None]:
        gl = self.context.gl
        program = Program(self.context, source, varyings=("v_value",) * (self.stage == "vertex"))
        for name, value in values.items():
            program.write(f"u_{name}", value)
        program.write("u_drift", np.full(3, DRIFT, dtype=np.float32))
        array = gl.vertex_array(program.gl, [])

        def draw() -> None:
            program.set_integer("u_count", self.rounds)
            self.target.use()
            if self.stage == "vertex":
                array.transform(self.captured, moderngl.POINTS, vertices=VERTICES)
            else:
                gl.enable_only(moderngl.NOTHING)
                array.render(moderngl.TRIANGLES, vertices=3)

        return draw

    def nanoseconds(self, source: Source, values: Mapping[str, Any], repeat: int) -> Spread:
        """[ns] an evaluation; values: of its uniforms, without the u_."""
        took = difference(self.context, self._drawing(source, values), self.without, repeat)
        scale = 1e9 / (self.places * self.rounds)
        return Spread(took.median * scale, took.low * scale, took.high * scale)
