"""Property: adding a model, light, picture format, mesh format, command, mutation or law needs new files and no edits.

A copy of glshade gets one of each, and none of its files is edited: a BRDF and a light are two files, one GLSL and one Python,
and everything else is one.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import glshade
from glshade.glsl.shaders import SHIPPED

ROOT = Path(__file__).parents[2]

FELT = '''
"""felt: a Lambertian base under a sheen, for its own test."""
from typing import Any, ClassVar, Literal
from glshade.brdfs import Array, Brdf, Colour, Law, Parameter, above_horizon, parameter

class Felt(Brdf):
    """A model whose parameters are all colours."""

    source: ClassVar[str] = "this test"
    breaks: ClassVar[dict[Law, str]] = {"energy": "a white sheen adds up to 2/3 to a white base"}
    brdf: Literal["felt"] = "felt"
    tint: Colour = parameter((0.5, 0.5, 0.5), Parameter("diffuse reflectance", high=1.0, base=True))
    sheen: Colour = parameter((0.25, 0.25, 0.25), Parameter("strength of the sheen", high=1.0))

    @staticmethod
    def brdf_cos(m: Any, l: Array, v: Array) -> Array:
        return above_horizon(l, v, (m.tint + m.sheen * l[..., 2:] * v[..., 2:]) * l[..., 2:] / 3.141592653589793)

    @staticmethod
    def ambient_reflectance(m: Any) -> Array:
        return m.tint
'''
FELT_GLSL = """
#include "math/constants.glsl"
#include "surface/frame.glsl"
struct Felt {
    vec3 tint;
    vec3 sheen;
};
vec3 brdf_cos(Felt m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    float NoV = dot(f.n, v);
    return NoL > 0.0 && NoV > 0.0 ? (m.tint + m.sheen * (NoL * NoV)) * (NoL * INV_PI) : vec3(0.0);
}
vec3 ambient_reflectance(Felt m) {
    return m.tint;
}
"""
LAMP = '''
"""lamp: shines straight down, the more the higher the place, for its own test."""
from typing import Any, Literal
import numpy as np
from glshade.lights import Array, Light

class LampLight(Light):
    """A light with a direction."""

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
DOME = '''
"""dome: a sky above and the ground below, for its own test."""
from typing import Any, ClassVar, Literal
import numpy as np
from glshade.document import Triple
from glshade.lights import Array, Light

class DomeLight(Light):
    """A light without a direction that depends on the normal."""

    type: Literal["dome"] = "dome"
    ground: Triple = (0.125, 0.0625, 0.0)
    omnidirectional: ClassVar[bool] = True

    def uniforms(self, eye: Array) -> dict[str, Any]:
        return {**super().uniforms(eye), "ground": np.array(self.ground)}

    @staticmethod
    def illuminate(light: Any, n: Array) -> Array:
        return light.intensity * (0.5 + 0.5 * n[..., 1:2] + light.ground * (0.5 - 0.5 * n[..., 1:2]))
'''
DOME_GLSL = """
struct DomeLight {
    vec3 intensity;
    vec3 ground;
};
vec3 illuminate(DomeLight light, vec3 n) {
    return light.intensity * (0.5 + 0.5 * n.y + light.ground * (0.5 - 0.5 * n.y));
}
"""
TGA = '''
"""TGA: Truevision's files, for its own test."""
from glshade.image.formats import PictureFormat

class Tga(PictureFormat):
    """Truevision TGA."""

    description_size = 323
'''
TRI = '''
"""TRI: nine numbers for each triangle, for its own test."""
import numpy as np
from glshade.mesh.reading.file import MeshFile, text_of

def read(file: MeshFile) -> None:
    corners = np.array(text_of(file.data).split(), dtype=np.float64).reshape(-1, 3)
    triangles = np.arange(len(corners)).reshape(-1, 3)
    file.contents.add(file.path.stem, file.build("", corners, triangles))
'''
HELLO = '''
"""glshade hello: greets, for its own test."""
import click

@click.command()
def command() -> None:
    """Greets the world."""
    click.echo("hello, world")
'''
DULL = '''
"""dull-felt: the sheen is forgotten, for its own test."""
from glshade.verification.mutations._mutation import Mutation

MUTATION = Mutation("dull-felt", "the sheen of felt is 0", edits=((r"m\\.sheen \\*", "0.0 *"),))
'''
DOUBLED = '''
"""doubled: twice the light gives twice the picture, for its own test."""
from glshade.verification.laws._law import Law

def _picture(scene, draw):
    lights = tuple(light.model_copy(update={"intensity": 2 * light.intensity}) for light in scene.lights)
    return draw(scene.model_copy(update={"lights": lights})) / 2

LAW = Law(name="doubled", description="twice the light gives twice the picture", picture=_picture)
'''
NEW = {
    "glshade/brdfs/felt.py": FELT,
    "shaders/brdf/felt.glsl": FELT_GLSL,
    "glshade/lights/lamp.py": LAMP,
    "shaders/light/lamp.glsl": LAMP_GLSL,
    "glshade/lights/dome.py": DOME,
    "shaders/light/dome.glsl": DOME_GLSL,
    "glshade/image/formats/tga.py": TGA,
    "glshade/mesh/formats/tri.py": TRI,
    "glshade/cli/hello.py": HELLO,
    "glshade/verification/mutations/dull_felt.py": DULL,
    "glshade/verification/laws/doubled.py": DOUBLED,
    "s.toml": """
objects = [{ mesh = "m.tri", material = { brdf = "felt", tint = [0.25, 0.5, 1.0] } }]
lights = [{ type = "lamp", level = -2, intensity = 0.5 }, { type = "dome", intensity = 0.25 }]
film = { size = [24, 16] }
""",
    "m.tri": "0 0 0  1 0 1  1 0 0\n0 0 0  0 0 1  1 0 1\n",
}
# The contract tests that run on the new files in the ordinary suite. The slow test runs all of them.
LAWS = ("test_gpu_equals_reference", "test_parameters_agree", "test_light_fields", "test_zero_below_horizon")

VERIFY = """
import math, sys
import numpy as np
import glshade
from glshade import BRDFS, LIGHTS, Renderer, Scene, evaluate
assert glshade.__file__.startswith(sys.argv[1]), glshade.__file__
assert "felt" in BRDFS and {"lamp", "dome"} <= set(LIGHTS)
felt = {"brdf": "felt", "tint": [0.25, 0.5, 1], "sheen": 0.5}

def scene(kind, count, shape, camera):
    each = {"lamp": {"intensity": 1 / count}, "dome": {"intensity": 0.5 / count, "ground": [0.125, 0.0625, 0]}}[kind]
    more = [{"level": -2 - i / count} if kind == "lamp" else {} for i in range(count)]
    lights = [{"type": kind, **each, **one} for one in more] + [{"type": "ambient", "intensity": 0.125}]
    objects = [{"shape": shape, "material": felt}]
    film = {"size": [8, 6]}
    return Scene.model_validate({"objects": objects, "lights": lights, "camera": camera, "film": film})

top = {"type": "orthographic", "eye": [0, 9, 0], "target": [0, 0, 0], "up": [0, 0, 1], "height": 1}
near = {"eye": [0, 1, 3], "target": [0, 0, 0]}
ball = {"type": "sphere", "segments": 8, "rings": 6}
with Renderer() as renderer:
    for kind in ("lamp", "dome"):
        plan = str(glshade.explain(scene(kind, 1, "plane", top)))
        assert "felt per pixel" in plan and kind in plan, plan
        # One alone, several, so many that they lie in a uniform block, and more than one block holds.
        for count in (1, 3, 20, 300):
            for rate in ("flat", "gouraud", "phong"):
                verdict = glshade.verify(scene(kind, count, ball, near), renderer=renderer, shading=rate)
                assert verdict.verdict == "verified", (kind, count, rate, str(verdict))
        # Seen from above and lit from there, felt has the value tint + sheen. The lamps' mean level is -2 - 1/3.
        tint = np.array(felt["tint"])
        light = (tint + 0.5) * (2 + 1 / 3) if kind == "lamp" else tint * 0.5
        for rate in ("flat", "gouraud", "phong"):
            pixels = renderer.render(scene(kind, 3, "plane", top), dtype="float32", shading=rate).pixels
            assert np.allclose(pixels, light + 0.125 * tint, rtol=1e-5), (kind, rate, pixels[0, 0])
    l, v = [0, 0.6, 0.8], [0, 0, 1]
    for on in ("reference", "vertex", "fragment"):
        value = evaluate(BRDFS["felt"](), l, v, on=on, context=renderer.context)
        assert np.allclose(value, (0.5 + 0.25 * 0.8) * 0.8 / math.pi, rtol=1e-6), (on, value)
print("verified")
"""

COMMANDS = """
import contextlib, io, json, os, sys
from glshade.cli import run

def glshade(*arguments):
    sys.argv = ["glshade", *arguments]
    with contextlib.redirect_stdout(io.StringIO()) as out:
        try:
            run()
        except SystemExit as end:
            assert not end.code, (arguments, end.code, out.getvalue())
    return out.getvalue()

assert "hello" in glshade("--help")
assert glshade("hello") == "hello, world\\n"
for kind, name in (("brdfs", "felt"), ("lights", "lamp"), ("lights", "dome")):
    assert name in glshade(kind) and "for its own test" in (said := glshade(kind, name)), said
assert glshade(*"plot felt:tint=0.25 -k polar -k albedo -k furnace -o felt.svg".split()) == "felt.svg\\n"
help = glshade("render", "--help")
assert "tga" in help and ".tri" in help
glshade("render", "s.toml", "-o", "x.tga")
written = os.stat("x.tga").st_mtime_ns
from glshade.image import file as picture_file
pixels, _ = picture_file.read("x.tga")
assert pixels.shape[:2] == (16, 24) and pixels[..., :3].max() > 0.1
record = json.loads(glshade("render", "s.toml", "-o", "x.tga", "--resume", "--json").splitlines()[-2])
assert os.stat("x.tga").st_mtime_ns == written, record
assert "dull-felt" in (said := glshade("verify", "s.toml", "--mutate", "dull-felt")) and " caught" in said, said
assert "verified" in glshade("verify", "s.toml")
assert glshade("laws", "s.toml", "--only", "doubled").count("holds") == 2
print("done")
"""

PAGES = """
import json, sys
sys.path.insert(0, "script")
import book, docs, presets
assert "`felt`" in (text := docs.scene_file()) and "`lamp`" in text and "`dome`" in text
assert "felt" in book.page({})
assert presets.page()
from glshade import Scene
schema = json.dumps(Scene.model_json_schema())
assert "tint" in schema and "dome" in schema
print("written")
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Returns the folder with the copy and the new files. No new file replaces an existing one."""
    folder = tmp_path_factory.mktemp("new")
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(Path(glshade.__file__).parent, folder / "glshade", ignore=ignored)
    shutil.copytree(SHIPPED, folder / "shaders")
    for name in ("script", "tests", "docs", "scenes"):
        shutil.copytree(ROOT / name, folder / name, ignore=ignored)
    shutil.copy(ROOT / "pyproject.toml", folder)
    for name, text in NEW.items():
        path = folder / name
        assert not path.exists()
        path.write_text(text)
    return folder


@pytest.fixture
def here(copy: Path, python: Any) -> Callable[[str], str]:
    """Returns a function: `here(code)` runs code in the copy, in a process of its own."""
    return lambda code: str(python(code, copy, cwd=copy, PYTHONPATH=str(copy)))


def put_to_the_laws(copy: Path, laws: list[Path], marks: str) -> int:
    """Runs the contract tests whose ids hold the name of a new model or light. All must pass. Returns their number."""
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-p", "no:xdist", "-m", marks]
    command += ["-k", "felt or lamp or dome", *map(str, laws)]
    environment = {**os.environ, "PYTHONPATH": str(copy)}
    done = subprocess.run(command, capture_output=True, text=True, cwd=copy, env=environment, check=False)
    assert done.returncode == 0, done.stdout
    return int(re.search(r"(\d+) passed", done.stdout)[1])  # type: ignore[index]


def test_a_model_and_lights_are_drawn_and_verified(here: Callable[[str], str]) -> None:
    assert here(VERIFY) == "verified"


def test_commands_formats_mutations_and_laws_are_found(here: Callable[[str], str]) -> None:
    assert here(COMMANDS) == "done"


def test_the_pages_have_them(here: Callable[[str], str]) -> None:
    assert here(PAGES) == "written"


def test_laws_are_put_to_them(copy: Path) -> None:
    assert put_to_the_laws(copy, [copy / "tests" / "contracts" / f"{law}.py" for law in LAWS], "not slow") >= len(LAWS)


@pytest.mark.slow
def test_every_law_is_put_to_them(copy: Path) -> None:
    laws = sorted((copy / "tests" / "contracts").glob("test_*.py"))
    laws = [law for law in laws if law.stem not in {Path(__file__).stem, "test_osmesa"}]
    assert put_to_the_laws(copy, laws, "slow or not slow") > len(LAWS)


@pytest.mark.slow
def test_the_scripts_write_the_pages(copy: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": str(copy)}
    for script in (["docs.py"], ["book.py", "--words"], ["presets.py"]):
        command = [sys.executable, *script]
        done = subprocess.run(command, capture_output=True, text=True, cwd=copy / "script", env=environment, check=False)
        assert done.returncode == 0, done.stderr
    for page in ("scene-file.md", "brdfs.md"):
        assert "felt" in (copy / "docs" / page).read_text()


def test_annotations_may_be_strings(python: Any) -> None:
    code = "from __future__ import annotations\n" + FELT.split('"""', 2)[2] + "\nprint(Felt.is_colour('tint'))"
    assert python(code) == "True"


def test_a_model_may_extend_another(python: Any) -> None:
    code = "from glshade.brdfs.phong import Phong\nclass Wide(Phong):\n    pass\n"
    assert python(code + "print(Wide.is_colour('kd'), Wide.is_colour('ka'), Wide.is_colour('exponent'))") == "True True False"
