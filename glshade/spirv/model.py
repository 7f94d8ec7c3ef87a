"""Model: runs GLSL functions of two directions, such as reflectance models, over arrays of directions, without a GPU."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.brdfs import Brdf, numbers
from glshade.glsl.generator import value_code
from glshade.glsl.shaders import Shaders, expand
from glshade.glsl.source import Code, Stage
from glshade.spirv.arithmetic import FLOAT64, Arithmetic
from glshade.spirv.compiler import compiled
from glshade.spirv.machine import Observer, run
from glshade.spirv.module import Module
from glshade.spirv.table import TableText

Array = NDArray[Any]

# The number of lanes that are run at once: their arrays then fit into the processor's caches, and a function with a hundred
# variables takes some 50 MB.
TILE = 1 << 14


@dataclass(frozen=True)
class ValueText:
    """The GLSL of a function `vec3 value(vec3 l, vec3 v)`, compiled.

    stage: the text of a vertex stage that calls the function.
    module: the same stage in SPIR-V.
    tables: sampler name -> table that the function reads.
    """

    stage: Stage
    module: Module
    tables: Mapping[str, TableText] = field(default_factory=dict)

    def run(
        self, inputs: Mapping[str, Any], lanes: int, arithmetic: Arithmetic = FLOAT64, observer: Observer | None = None
    ) -> Array:
        """Returns the function's values (lanes, 3).

        inputs: `a_l` and `a_v`, directions (lanes, 3), and the uniforms by name, such as a model's parameters `u_NAME`, each
            for all lanes or with the axis of lanes first.
        Errors: ShaderError.
        """
        given = {**_ZERO, **inputs, **self.tables}
        result = run(self.module, given, lanes, arithmetic, observer=observer, place=self.stage.place)
        return np.asarray(result.outputs["v_value"])


# Built-in inputs that the compiler lists for every vertex stage.
_ZERO = {"gl_VertexID": 0, "gl_InstanceID": 0}


def value_text(code: Mapping[str, Code | str], shaders: Shaders | None = None) -> ValueText:
    """Returns the GLSL of a function of two directions.

    code: place -> code; the place `model` defines `vec3 value(vec3 l, vec3 v)`.
    shaders: optional; the shader files. Default: those that ship with glshade.
    Errors: ShaderError, MissingLibrary.
    """
    stage = expand("pass/evaluate.vert", code, shaders)
    return ValueText(stage, compiled(stage, "vertex"))


def model_text(brdf: Brdf, shaders: Shaders | None = None) -> ValueText:
    """Returns the GLSL of a material's model, with the code that its options choose. Its values are f cos [1/sr].

    shaders: optional; the shader files. Default: those that ship with glshade.
    Errors: ShaderError, MissingLibrary; AssetError for a table whose file cannot be read.
    """
    tables = {f"u_{name}": TableText(volume) for name, volume in brdf.volumes().items()}
    return replace(value_text(value_code(brdf), shaders), tables=tables)


def evaluate_text(brdf: Brdf, l: Array, v: Array, shaders: Shaders | None = None, arithmetic: Arithmetic = FLOAT64) -> Array:
    """Returns f cos (N, 3) [1/sr] of a model's GLSL.

    l, v: unit directions (N, 3) to the light and to the viewer, in the local frame.
    Errors: ShaderError, MissingLibrary; ValueError for a parameter that is a texture.
    """
    text = model_text(brdf, shaders)
    parameters = {f"u_{name}": value for name, value in numbers(brdf).items()}
    result = np.zeros((len(l), 3), arithmetic.dtype)
    for start in range(0, len(l), TILE):
        tile = slice(start, start + TILE)
        inputs = {"a_l": l[tile], "a_v": v[tile], **parameters}
        result[tile] = text.run(inputs, len(l[tile]), arithmetic)
    return result
