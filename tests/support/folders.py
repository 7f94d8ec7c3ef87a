"""Folders: a model folder and shader files as a user would write them, and the values in their pictures.

With CHALK and ZENITH the whole picture of SCENE has the value VALUE. With the file `lambert(x)` in place of the shipped one, a
Lambertian surface has the value pi x kd under a light of intensity 1 from any direction.
"""

from __future__ import annotations

import math
import os
from pathlib import Path

import numpy as np
import pytest

from glshade import BRDFS, LIGHTS
from glshade.scene import models

# f cos = tint (n.l)^2: neither reciprocal nor energy-conserving, but easy to compute by hand.
CHALK = """
from __future__ import annotations

from typing import Any, ClassVar, Literal

from _shared import squared
from glshade.brdfs import Array, Brdf, Colour, Law, Parameter, above_horizon, parameter


class Chalk(Brdf):
    source: ClassVar[str] = "this test"
    breaks: ClassVar[dict[Law, str]] = {"reciprocity": "one cosine too many", "energy": "2 pi/3 of it leaves a white one"}
    brdf: Literal["chalk"] = "chalk"
    tint: Colour = parameter((0.5, 0.5, 0.5), Parameter("strength", base=True))

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        return above_horizon(l, v, m.tint * squared(l[..., 2:]))

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        return m.tint
"""
CHALK_GLSL = """
#include "surface/frame.glsl"
struct Chalk {
    vec3 tint;
};
vec3 brdf_cos(Chalk m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    return NoL > 0.0 && dot(f.n, v) > 0.0 ? m.tint * (NoL * NoL) : vec3(0.0);
}
vec3 ambient_reflectance(Chalk m) {
    return m.tint;
}
"""
SHARED = "def squared(x):\n    return x**2\n"
ZENITH = """
from typing import Any, Literal

import numpy as np

from glshade.lights import Array, Light


class ZenithLight(Light):
    type: Literal["zenith"] = "zenith"

    @staticmethod
    def illuminate(light: Any, p: Array) -> tuple[Array, Array]:
        return np.broadcast_to([0.0, 1.0, 0.0], p.shape), np.broadcast_to(light.intensity, p.shape)
"""
ZENITH_GLSL = """
struct ZenithLight {
    vec3 intensity;
};
vec3 illuminate(ZenithLight light, vec3 p, out vec3 l) {
    l = vec3(0.0, 1.0, 0.0);
    return light.intensity;
}
"""
SCENE = """
objects = [{ shape = "plane", material = { brdf = "chalk", tint = [0.25, 0.5, 1.0] } }]
lights = [{ type = "zenith" }]
camera = { type = "orthographic", eye = [0, 2, 0], target = [0, 0, 0], up = [0, 0, 1], height = 1 }
film = { size = [4, 4] }
"""
VALUE = math.pi * np.array([0.25, 0.5, 1.0])


def lambert(value: str) -> str:
    """Returns the text of a file that replaces brdf/lambert.glsl, with f cos = value kd. value: a GLSL expression."""
    return f"""
#include "surface/frame.glsl"
struct Lambert {{
    vec3 kd;
}};
vec3 brdf_cos(Lambert m, Frame f, vec3 l, vec3 v) {{
    return {value} * m.kd;
}}
vec3 ambient_reflectance(Lambert m) {{
    return m.kd;
}}
"""


def write(folder: Path, name: str, text: str) -> Path:
    """Writes a file below a folder, which is made if need be.

    Tests may write a file twice within one tick of the file system's clock, so the second file is dated a second later.
    """
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    before = path.stat().st_mtime_ns if path.exists() else 0
    path.write_text(text)
    if before:
        os.utime(path, ns=(before + 10**9, before + 10**9))
    return path


def write_models(folder: Path) -> Path:
    """Writes the model, a file that it imports, and the light. Returns the folder."""
    for name, text in (("chalk", CHALK), ("zenith", ZENITH), ("_shared", SHARED)):
        write(folder, f"{name}.py", text)
    for name, text in (("chalk", CHALK_GLSL), ("zenith", ZENITH_GLSL)):
        write(folder, f"{name}.glsl", text)
    return folder


def forget_models(patch: pytest.MonkeyPatch) -> None:
    """Makes the process forget all model folders. Models that it adds later are removed when the patch ends."""
    patch.setattr(models, "_folders", {})
    patch.setattr(models, "_alone", {})
    for found in (BRDFS, LIGHTS):
        patch.setattr(found, "_names", list(found._names))
        patch.setattr(found, "_classes", dict(found._classes))
