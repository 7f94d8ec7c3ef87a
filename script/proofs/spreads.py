"""A driver's values of the models lie within 4 spreads of random rounding, at 99.99 % of all inputs.

An input is a pair of directions and random parameters of a model. The spread is the largest deviation, from the model's GLSL in
float64, of RUNS runs of the same GLSL in which every operation errs at random by at most what OpenGL allows. The proof runs the
GLSL on the driver at hand, in both stages, and prints the share of values beyond 4 spreads for each model.
"""

from __future__ import annotations

import math

import numpy as np

from glshade.brdfs import BRDFS, Brdf
from glshade.gl.context import Context, open_context
from glshade.gl.evaluation import run_on_gpu
from glshade.glsl.generator import value_code
from glshade.glsl.shaders import current
from glshade.glsl.uniforms import model_inputs
from glshade.spirv.arithmetic import FLOAT64, RandomRounding
from glshade.spirv.model import model_text
from glshade.spirv.ranges import directions, parameters, variants

# About a million values: an input has three channels in two stages.
COUNT = 170_000
# The number of values of one material: the driver takes a material's parameters as uniforms.
OF_A_MATERIAL = 512
# The number of runs that make a spread.
RUNS = 8
# A driver may err by this many spreads, at all but this share of the values.
SPREADS, BEYOND = 4.0, 1e-4
# Errors below these do not count, relative to 1 and to the value: a result that no operation has rounded has no spread, and
# results below the smallest normal float32 are flushed to zero.
LEAST, LEAST_RELATIVE = 1e-9, 2.0**-23


def prove(count: int, seed: int) -> int:
    """Runs all models at `count` inputs together, and returns the number of values beyond the share that the claim allows."""
    random = np.random.default_rng(seed)
    materials = [(name, variant) for name, model in BRDFS.items() for variant in variants(model)]
    rounds = max(1, round(count / OF_A_MATERIAL / len(materials)))
    beyond = total = 0
    largest = 0.0
    context = open_context()
    try:
        for name, variant in materials:
            ratios = np.concatenate([_ratios(context, variant, random) for _ in range(rounds)])
            far = int(np.count_nonzero(ratios > SPREADS))
            if far:
                print(f"{name} {variant.chosen()}: {far} of {ratios.size} beyond {SPREADS:g}, the farthest {ratios.max():.1f}")
            beyond, total, largest = beyond + far, total + ratios.size, max(largest, float(ratios.max()))
    finally:
        context.release()
    print(f"{beyond} of {total} values lie beyond {SPREADS:g} spreads, the farthest at {largest:.1f}")
    return max(0, beyond - math.ceil(BEYOND * total))


def _ratios(context: Context, variant: Brdf, random: np.random.Generator) -> np.ndarray:
    """Returns the errors of the driver in both stages, in spreads, at random directions and one set of random parameters."""
    l, v = directions(OF_A_MATERIAL, random)
    values = {f"u_{name}": value[0] for name, value in parameters(variant, 1, random).items()}
    text = model_text(variant)
    inputs = {"a_l": l, "a_v": v, **values}
    exact = text.run(inputs, len(l), FLOAT64)
    runs = [text.run(inputs, len(l), RandomRounding(random=random)) for _ in range(RUNS)]
    spread = np.maximum.reduce([np.abs(run - exact) for run in runs])
    spread = np.maximum(spread, np.maximum(LEAST, LEAST_RELATIVE * np.abs(exact)))
    code, files = value_code(variant), current()
    given = {**model_inputs(variant), **values}
    errors = [np.abs(run_on_gpu(context, stage, code, given, l, v, files) - exact) for stage in ("vertex", "fragment")]
    return np.concatenate([(error / spread).ravel() for error in errors])
