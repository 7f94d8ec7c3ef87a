"""Law: a new model or light is two files, one GLSL and one Python, and no edit of anything else."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import glshade

TOY = '''
"""toy: cos^2, for its own test."""
from typing import Any, ClassVar, Literal
from glshade.brdfs import Array, Brdf, Colour, Law, Parameter, above_horizon, parameter

class Toy(Brdf):
    source: ClassVar[str] = "this test"
    breaks: ClassVar[dict[Law, str]] = {"reciprocity": "one cosine too many", "energy": "2 pi/3 of it leaves a white one"}
    brdf: Literal["toy"] = "toy"
    tint: Colour = parameter((0.5, 0.5, 0.5), Parameter("strength", base=True))

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        return above_horizon(l, v, m.tint * l[..., 2:] ** 2)

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        return m.tint
'''
TOY_GLSL = """
#include "lib/frame.glsl"
struct Toy {
    vec3 tint;
};
vec3 brdf_cos(Toy m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    return NoL > 0.0 && dot(f.n, v) > 0.0 ? m.tint * (NoL * NoL) : vec3(0.0);
}
vec3 ambient_reflectance(Toy m) {
    return m.tint;
}
"""
LAMP = '''
"""lamp: shines straight down, the more the higher the place, for its own test."""
from typing import Any, Literal
import numpy as np
from glshade.lights import Array, Light

class LampLight(Light):
    type: Literal["lamp"] = "lamp"
    level: float = 0.0

    def uniforms(self, eye: Array) -> dict[str, Any]:
        return {**super().uniforms(eye), "level": self.level - eye[1]}

    @staticmethod
    def illuminate(light: Any, p: Array) -> tuple[Array, Array]:
        return np.broadcast_to([0.0, 1.0, 0.0], p.shape), light.intensity * (p[..., 1:2] - light.level)
'''
LAMP_GLSL = """
struct LampLight {
    vec3 intensity;
    float level;
};
vec3 illuminate(LampLight light, vec3 p, out vec3 l) {
    l = vec3(0.0, 1.0, 0.0);
    return light.intensity * (p.y - light.level);
}
"""
# The contracts that a model without options or limits has to keep.
LAWS = {
    *("test_finite_and_non_negative", "test_gpu_equals_reference", "test_reciprocity", "test_energy", "test_isotropy"),
    *("test_zero_below_horizon", "test_parameters_agree", "test_extremes_conditioning", "test_extremes_horizon"),
}
USE = """
import math, sys
import numpy as np
import glshade
from glshade import BRDFS, LIGHTS, Renderer, Scene, evaluate
assert glshade.__file__.startswith(sys.argv[1]), glshade.__file__
assert "toy" in BRDFS and "lamp" in LIGHTS
top = {"type": "orthographic", "eye": [0, 9, 0], "target": [0, 0, 0], "up": [0, 0, 1], "height": 1}
plane = {"shape": "plane", "material": {"brdf": "toy", "tint": [0.25, 0.5, 1]}}
def scene(count):
    lights = [{"type": "lamp", "level": -2, "intensity": 0.5}] * count + [{"type": "ambient", "intensity": 0.125}]
    return Scene.model_validate({"objects": [plane], "lights": lights, "camera": top, "film": {"size": [4, 4]}})
plan = str(glshade.explain(scene(1)))
assert "toy per pixel" in plan and "lamp" in plan, plan
with Renderer() as renderer:
    # One alone, several, and so many that they lie in a uniform block: height 2, strength 1/2, pi of pi (f cos) I.
    for count in (1, 3, 20):
        for rate in ("flat", "gouraud", "phong"):
            pixels = renderer.render(scene(count), dtype="float32", shading=rate).pixels
            assert np.allclose(pixels / [0.25, 0.5, 1], math.pi * count + 0.125, rtol=1e-6), (count, rate, pixels[0, 0])
    l, v = [0, 0.6, 0.8], [0, 0, 1]
    for on in ("reference", "vertex", "fragment"):
        assert np.allclose(evaluate(BRDFS["toy"](), l, v, on=on, context=renderer.context), 0.32, rtol=1e-6)
    for rate in ("flat", "gouraud", "phong"):
        assert glshade.verify(scene(3), renderer=renderer, shading=rate).verdict == "verified"
print("found")
"""


def test_a_toy_model_and_a_toy_light_are_found_and_drawn(tmp_path: Path, python: Any) -> None:
    package = Path(glshade.__file__).parent
    shutil.copytree(package, tmp_path / "glshade", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(glshade.glsl.generator.SHADERS, tmp_path / "shaders")
    (tmp_path / "glshade/brdfs/toy.py").write_text(TOY)
    (tmp_path / "shaders/brdf/toy.glsl").write_text(TOY_GLSL)
    (tmp_path / "glshade/lights/lamp.py").write_text(LAMP)
    (tmp_path / "shaders/light/lamp.glsl").write_text(LAMP_GLSL)
    assert python(USE, tmp_path, PYTHONPATH=str(tmp_path), cwd=tmp_path) == "found"
    # Every law is put to it: the contracts run on what is found.
    tests = Path(__file__).parent.parent
    laws = [str(path) for path in sorted((tests / "contracts").glob("test_*.py")) if path.stem in LAWS]
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-p", "no:xdist", "-m", "not slow", "-k", "toy"]
    command += ["-c", str(tests.parent / "pyproject.toml"), *laws]
    path = f"{tmp_path}{os.pathsep}{tests}"
    environment = {**os.environ, "PYTHONPATH": path}
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, env=environment, check=False)
    assert done.returncode == 0, done.stdout
    assert int(re.search(r"(\d+) passed", done.stdout)[1]) >= len(LAWS), done.stdout  # type: ignore[index]
    assert "failed" not in done.stdout
    # The schema tells the world.
    code = "import json; from glshade import Scene; s = json.dumps(Scene.model_json_schema()); print('tint' in s, 'lamp' in s)"
    assert python(code, PYTHONPATH=str(tmp_path), cwd=tmp_path) == "True True"


def test_annotations_may_be_strings(python: Any) -> None:
    assert python("from __future__ import annotations\n" + TOY.split('"""')[2] + "\nprint(Toy.is_colour('tint'))") == "True"


def test_a_model_may_extend_another(python: Any) -> None:
    code = "from glshade.brdfs.phong import Phong\nclass Wide(Phong):\n    pass\n"
    assert python(code + "print(Wide.is_colour('kd'), Wide.is_colour('ka'), Wide.is_colour('exponent'))") == "True True False"
