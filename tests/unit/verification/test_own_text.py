"""Pictures that are compared with their own GLSL, run in float64."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from support.folders import forget_models
from support.texts import needs_compiler

from glshade import Renderer, Scene, load, verify
from glshade.errors import NoReference
from glshade.glsl.shaders import current
from glshade.glsl.source import Source
from glshade.verification.trials import try_mutations

pytestmark = needs_compiler

SCENES = Path(__file__).parent.parent.parent.parent / "scenes"


def small(name: str, width: int = 96) -> Scene:
    """Returns a shipped scene at a small size, with one sample a pixel."""
    scene = load(SCENES / f"{name}.toml")
    w, h = scene.film.size
    film = scene.film.model_copy(update={"size": (width, max(1, round(h * width / w))), "samples": 1})
    return scene.model_copy(update={"film": film})


@pytest.mark.parametrize("name", ["shading-rates", "spot", "spatial-variation"])
def test_a_shipped_scene_agrees_with_its_own_text(name: str, renderer: Renderer) -> None:
    verdict = verify(small(name), renderer=renderer, derived=True)
    assert verdict.verdict == "verified"
    assert verdict.derived
    assert str(verdict).startswith("verified against its own text: ")
    assert verdict.as_dict()["verdict"] == "verified against its own text"
    assert verdict.notes == ()


@pytest.mark.slow
@pytest.mark.parametrize("path", sorted(SCENES.glob("*.toml")), ids=lambda path: path.stem)
def test_every_shipped_scene_agrees_with_its_own_text(path: Path, renderer: Renderer) -> None:
    verdict = verify(small(path.stem, 128), renderer=renderer, derived=True, max_ambiguous=0.1)
    assert verdict.unexplained == 0
    assert verdict.notes == ()


def test_mutations_of_the_drawn_text_are_caught(renderer: Renderer) -> None:
    trials = try_mutations(small("shading-rates"), renderer=renderer, derived=True)
    assert sum(trial.shows for trial in trials) >= 10
    assert [trial.mutation.name for trial in trials if trial.shows and not trial.caught] == []


def test_the_line_that_differs_from_the_python_function_is_named(tmp_path: Path, renderer: Renderer) -> None:
    (tmp_path / "brdf").mkdir()
    text = "\n".join(current().find("brdf/lambert.glsl").lines)  # type: ignore[union-attr]
    changed = text.replace("INV_PI * NoL", "INV_PI * 1.02 * NoL")
    assert changed != text
    path = tmp_path / "brdf" / "lambert.glsl"
    path.write_text(changed)
    line = 1 + next(i for i, line in enumerate(changed.splitlines()) if "1.02" in line)
    scene = Scene.model_validate(
        {
            "objects": [{"name": "ball", "shape": "sphere", "material": {"brdf": "lambert"}}],
            "lights": [{"type": "directional", "direction": [0, 0, -1]}],
            "film": {"size": [48, 48]},
        }
    )
    with Renderer(shaders=tmp_path) as own:
        verdict = verify(scene, renderer=own, derived=True)
        against_twin = verify(scene, renderer=own)
    assert verdict.verdict == "verified"
    (note,) = verdict.notes
    assert note.startswith("the GLSL of ball and the Python function of its model, lambert, differ at ")
    assert note.endswith(f"; the line that makes the difference is {path}:{line}")
    assert against_twin.verdict == "failed"


@pytest.fixture(autouse=True)
def _own_models(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each test forgets the models that it has added."""
    forget_models(monkeypatch)


HEAD = '#include "surface/frame.glsl"\nstruct {name} {{\n    float width; // [0, 1] default {width}: width\n}};\n'
BODY = (
    "vec3 brdf_cos({name} m, Frame f, vec3 l, vec3 v) {{\n    vec3 h = normalize(l + v);\n"
    "    float NoH = dot(f.n, h);\n    float NoL = max(dot(f.n, l), 0.0);\n    {line}\n    return vec3(x * NoL);\n}}\n"
)
# Formulas that float32 cannot compute: a driver's picture is far from the exact one, and yet the driver is not wrong.
UNSTABLE = {
    "textbook_ggx": "float a2 = m.width * m.width; float t = NoH * NoH * (a2 - 1.0) + 1.0; float x = 1e-6 * a2 / (t * t);",
    "one_minus_cosine": "float x = sqrt(max(1.0 - NoH, 0.0) * 1e6) * 0.001;",
    "power_of_a_cosine": "float x = 0.3 * pow(max(NoH, 0.0), 2e6);",
    "difference_of_squares": "float x = 1e4 * ((1.0 + 1e-4 * NoH) * (1.0 + 1e-4 * NoH) - 1.0) * 0.2;",
    "angle_of_a_cosine": "float x = 3.0 * acos(clamp(NoH, -1.0, 1.0));",
    "tangent_from_cosine": "float x = min(20.0 * sqrt(max(1.0 / (NoH * NoH) - 1.0, 0.0)), 1.0);",
    "far_offset": "vec3 p = h * 0.001 + vec3(300.0); float x = length(p - vec3(300.0)) * 300.0;",
    "small_difference_of_roots": "float x = 2e3 * (sqrt(1.0 + 1e-3 * NoH) - sqrt(1.0 + 1e-4 * NoH));",
    "sine_of_a_large_angle": "float x = 0.5 + 0.5 * sin(4e4 * NoH);",
    "logarithm_near_one": "float x = min(-2e3 * log(max(NoH, 1e-3)), 1.0);",
}
# What a compiler might do to a text: (text, changed text). All are large enough to see.
MISCOMPILED = {
    "a factor": ("return vec3(x * NoL);", "return vec3(x * NoL * 1.01);"),
    "a sign": ("vec3 h = normalize(l + v);", "vec3 h = normalize(l - v);"),
    "an operand": ("float NoH = dot(f.n, h);", "float NoH = dot(f.n, v);"),
    "a clamp": ("float NoL = max(dot(f.n, l), 0.0);", "float NoL = clamp(dot(f.n, l), 0.0, 0.9);"),
    "a lost statement": ("return vec3(x * NoL);", "return vec3(x);"),
    "a swapped component": ("return vec3(x * NoL);", "return vec3(x * NoL, x * NoL, 0.5 * x * NoL);"),
    "a lost normalisation": ("vec3 h = normalize(l + v);", "vec3 h = 0.5 * (l + v);"),
    "a constant": ("0.3 + 0.5 * NoH", "0.31 + 0.5 * NoH"),
    "an exponent": ("NoH * NoH", "NoH * NoH * NoH"),
    "a branch": ("NoH > 0.9 ? 0.8 : 0.4", "NoH > 0.92 ? 0.8 : 0.4"),
}
STEADY = "float x = 0.3 + 0.5 * NoH - 0.1 * NoH * NoH + (NoH > 0.9 ? 0.8 : 0.4);"


def scene_of(tmp_path: Path, name: str, line: str, width: float = 0.002) -> Scene:
    """Returns a scene with one ball of a model that has only a GLSL file."""
    class_name = "".join(word.capitalize() for word in name.split("_"))
    values = {"name": class_name, "width": width, "line": line}
    (tmp_path / f"{name}.glsl").write_text(HEAD.format(**values) + BODY.format(**values))
    path = tmp_path / "scene.toml"
    path.write_text(
        f'objects = [{{ shape = {{ type = "sphere", segments = 96, rings = 48 }}, material = {{ brdf = "{name}" }} }}]\n'
        'lights = [{ type = "directional", direction = [-0.3, -0.2, -1], intensity = 1.0 }]\n[film]\nsize = [64, 64]\n'
    )
    return load(path, models=tmp_path)


@pytest.mark.parametrize("name", UNSTABLE)
def test_an_unstable_shader_is_no_fault_of_the_driver(name: str, tmp_path: Path, renderer: Renderer) -> None:
    verdict = verify(scene_of(tmp_path, name, UNSTABLE[name]), renderer=renderer, models=tmp_path)
    assert verdict.derived
    assert verdict.unexplained == 0, verdict


@pytest.mark.parametrize("name", MISCOMPILED)
def test_a_miscompiled_shader_is(name: str, tmp_path: Path, renderer: Renderer) -> None:
    right, wrong = MISCOMPILED[name]

    def miscompiled(source: Source) -> Source:
        assert source.fragment is not None
        assert right in source.fragment.text or right in source.vertex.text
        stages = [replace(stage, text=stage.text.replace(right, wrong)) for stage in (source.vertex, source.fragment)]
        return Source(*stages)

    scene = scene_of(tmp_path, "steady", STEADY)
    assert verify(scene, renderer=renderer, models=tmp_path).verdict == "verified"
    renderer.rewrite = miscompiled
    try:
        verdict = verify(scene, renderer=renderer, models=tmp_path)
    finally:
        renderer.rewrite = None
    assert verdict.verdict == "failed", verdict


def test_a_compiler_that_is_missing(tmp_path: Path, renderer: Renderer, monkeypatch: Any) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    scene = scene_of(tmp_path, "lonely", "float x = 0.123;")
    with pytest.raises(NoReference, match=r"'lonely' has only its GLSL.*apt install glslang-tools"):
        verify(scene, renderer=renderer, models=tmp_path)
