"""Detail: measures how a driver filters textures: the rule for the level of detail, and the weights of neighbouring texels."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.driver.figures import rounded
from glshade.driver.programs import COVER, load_program
from glshade.gl.context import Context
from glshade.gl.program import Program
from glshade.gl.screen import Screen
from glshade.gl.textures import mipmapped
from glshade.radiance.sampler import RULES

Array = NDArray[np.float64]
Float32 = NDArray[np.float32]

# The program draws SQUARES * SQUARES squares of 2 x 2 pixels.
SQUARES = 32
# The side of the texture that shows the level of detail [texels]. Its levels are numbered from 0 to LAST.
SIDE, LAST = 64, 6
# A rule for the level of detail is recognised if no level differs from it by more than this [levels]. Drivers approximate the
# logarithm; the rules differ from each other by up to 0.5 and 1.
RECOGNISED = 0.1


def measure_detail(context: Context) -> dict[str, Any]:
    """Measures the filtering of textures. Returns a dictionary ready for JSON:

    "level_of_detail": "rule" is the name of the rule in glshade.radiance.sampler.RULES that the driver follows, or None if it
        follows none of them. "error" is the largest difference from this rule, or from the range that OpenGL allows [levels].
    "filter_weight_error": the largest error of the weights of two neighbouring texels [texels].
    Errors: ShaderError, ContextError.
    """
    program = load_program(context, COVER, "driver/detail.frag")
    program.set_integer("u_texture", 1)
    random = np.random.default_rng(3)
    return {
        "level_of_detail": _level_of_detail(context, program, random),
        "filter_weight_error": _filter_weight_error(context, program, random),
    }


def _draw(context: Context, program: Program, chain: list[Float32], changes: Array) -> tuple[Array, Array]:
    """Returns (what the squares show (SQUARES^2, 2, 2), the changes in float64 as they were uploaded (SQUARES^2, 4)).

    chain: the red channel of the texture's levels (h, w). The result is the red channel, too.
    changes: the changes du/dx, dv/dx, du/dy, dv/dy of the texture coordinates of each square (SQUARES^2, 4).
    """
    screen, uploaded = Screen(context, (2 * SQUARES, 2 * SQUARES)), changes.astype(np.float32)
    screen.upload(uploaded.reshape(SQUARES, SQUARES, 4))
    texture = mipmapped(context, [np.repeat(level[..., None], 4, axis=2) for level in chain])
    texture.use(1)
    screen.draw(program)
    shown = screen.readback()[..., 0].astype(np.float64).reshape(SQUARES, 2, SQUARES, 2)
    return shown.swapaxes(1, 2).reshape(-1, 2, 2), uploaded.astype(np.float64)


def _level_of_detail(context: Context, program: Program, random: np.random.Generator) -> dict[str, Any]:
    """Returns "rule" and "error", as `measure_detail` explains them. Every texel of a level shows the number of its level."""
    chain = [np.full((SIDE >> level, SIDE >> level), level, dtype=np.float32) for level in range(LAST + 1)]
    shown, changes = _draw(context, program, chain, _changes(random) / SIDE)
    dx, dy = np.split(changes * SIDE, 2, axis=1)
    errors = {rule: float(np.abs(shown - np.log2(span(dx, dy))[:, None, None]).max()) for rule, span in RULES.items()}
    rule = min(errors, key=lambda name: errors[name])
    if errors[rule] <= RECOGNISED:
        return {"rule": rule, "error": rounded(errors[rule])}
    least, largest = (np.log2(RULES[name](dx, dy))[:, None, None] for name in ("largest", "sum"))
    return {"rule": None, "error": rounded(np.maximum(least - shown, shown - largest).max(initial=0.0))}


def _changes(random: np.random.Generator) -> Array:
    """Returns random changes of texture coordinates (SQUARES^2, 4) [texels], whose levels of detail are from 0 to LAST."""
    count = SQUARES * SQUARES
    angle = random.uniform(0, 2 * np.pi, (count, 2))
    share = random.uniform(0, 1, (count, 2))
    share[np.arange(count), random.integers(0, 2, count)] = 1
    # By the rule "largest" the level is up to 0.5 less, and by the rule "sum" up to 1 more than the logarithm of the length.
    length = share * 2.0 ** random.uniform(0.6, LAST - 1.1, (count, 1))
    return np.stack([length * np.cos(angle), length * np.sin(angle)], axis=2).reshape(count, 4)


def _filter_weight_error(context: Context, program: Program, random: np.random.Generator) -> float:
    """Returns the largest error of the weights of two neighbouring texels [texels].

    The texture has two texels, 0 and 1. The coordinate u lies between -1/4, the middle of the one that shows 1, and 1/4, the
    middle of the one that shows 0. It changes by less than a texel, so that level 0 is read.
    """
    changes = np.zeros((SQUARES * SQUARES, 4))
    changes[:, 0] = random.uniform(-0.25, 0.25, len(changes))
    chain = [np.array([[0.0, 1.0]], dtype=np.float32), np.array([[0.5]], dtype=np.float32)]
    shown, uploaded = _draw(context, program, chain, changes)
    return rounded(np.abs(shown[:, 0, 1] - (0.5 - 2 * uploaded[:, 0])).max())
