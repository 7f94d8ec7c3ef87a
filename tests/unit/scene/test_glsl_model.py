"""GLSL models: a reflectance model may be a GLSL file alone; it is drawn, and said to have no reference."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.folders import CHALK_GLSL, SCENE, VALUE, forget_models, write, write_models
from support.texts import needs_compiler

import glshade
from glshade import BRDFS, Renderer
from glshade.errors import NoReference, SceneError, ShaderError
from glshade.scene.models import use_models

# The members have declarations; the file is otherwise that of the model with a Python file.
MEMBERS = """    vec3 tint;    // [0, 1] default [0.25, 0.5, 1] base: strength
    float gain;   // [0, inf] usual [0, 4] default 1 unit cd: factor
    float plain;  // a description alone
    float bare;
"""
SLATE = CHALK_GLSL.replace("Chalk", "Slate").replace("    vec3 tint;\n", MEMBERS).replace("m.tint * (", "m.gain * m.tint * (")
SLATE_SCENE = SCENE.replace('"chalk"', '"slate"').replace('"zenith"', '"directional", direction = [0, -1, 0]')


@pytest.fixture(autouse=True)
def nothing_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    forget_models(monkeypatch)


@pytest.fixture
def models(tmp_path: Path) -> Path:
    """A model folder with one GLSL file and no Python file."""
    write(tmp_path, "models/slate.glsl", SLATE)
    return tmp_path / "models"


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """A scene with that model."""
    return write(tmp_path, "s.toml", SLATE_SCENE)


def test_the_struct_declares_the_parameters(models: Path) -> None:
    use_models(models)
    model = BRDFS["slate"]
    tint, gain, plain, bare = model.parameters().values()
    assert (tint.low, tint.high, tint.base, tint.description) == (0, 1, True, "strength")
    assert (gain.low, gain.high, gain.usual, gain.unit, gain.description) == (0, None, (0, 4), "cd", "factor")
    assert (plain.low, plain.high, plain.usual, plain.description) == (0, None, (0, 1), "a description alone")
    assert bare.description == "the member bare of the struct"
    material = model.model_validate({})
    assert [getattr(material, name) for name in model.parameters()] == [(0.25, 0.5, 1), 1, 0.5, 0.5]
    assert not model.has_reference


def test_it_is_drawn(models: Path, scene: Path, renderer: Renderer) -> None:
    loaded = glshade.load(scene, models=models)
    assert np.allclose(renderer.render(loaded, dtype="float32").pixels, VALUE, rtol=1e-6)
    twice = glshade.load(scene, {"objects.0.material.gain": 2})
    assert np.allclose(renderer.render(twice, dtype="float32").pixels, 2 * VALUE, rtol=1e-6)


def test_ambient_light_is_computed_on_the_gpu(models: Path, scene: Path, renderer: Renderer) -> None:
    scene.write_text(SLATE_SCENE.replace('[{ type = "directional", direction = [0, -1, 0] }]', '[{ type = "ambient" }]'))
    pixels = renderer.render(glshade.load(scene, models=models), dtype="float32").pixels
    assert np.allclose(pixels, [0.25, 0.5, 1], rtol=1e-6)


def test_a_model_without_ambient_reflectance_stays_black(models: Path, scene: Path, renderer: Renderer) -> None:
    scene.write_text(SLATE_SCENE.replace('[{ type = "directional", direction = [0, -1, 0] }]', '[{ type = "ambient" }]'))
    (models / "slate.glsl").write_text(SLATE.partition("vec3 ambient_reflectance")[0])
    assert not renderer.render(glshade.load(scene, models=models), dtype="float32").pixels.any()


def test_there_is_no_reference_picture(models: Path, scene: Path) -> None:
    loaded = glshade.load(scene, models=models)
    with pytest.raises(NoReference, match=r'slate\.glsl: the model "slate" has no reference, because no slate\.py') as caught:
        glshade.reference.render(loaded)
    assert caught.value.exit_code == 7


@needs_compiler
def test_verify_compares_with_the_glsl(models: Path, scene: Path, renderer: Renderer) -> None:
    verdict = glshade.verify(glshade.load(scene, models=models), renderer=renderer)
    assert verdict.words == "verified against its own text"


def test_a_shader_folder_may_hold_models(tmp_path: Path, scene: Path) -> None:
    write(tmp_path, "own/brdf/slate.glsl", SLATE)
    write(tmp_path, "own/brdf/part.glsl", "float half_of(float x) {\n    return 0.5 * x;\n}\n")
    with pytest.raises(SceneError, match="slate"):
        glshade.load(scene)
    loaded = glshade.load(scene, shaders=tmp_path / "own")
    assert "part" not in BRDFS
    with Renderer(shaders=tmp_path / "own") as renderer:
        assert np.allclose(renderer.render(loaded, dtype="float32").pixels, VALUE, rtol=1e-6)


def test_a_file_that_replaces_a_model_keeps_its_class(tmp_path: Path) -> None:
    write(tmp_path, "own/brdf/lambert.glsl", SLATE.replace("Slate", "Lambert"))
    with Renderer(shaders=tmp_path / "own"):
        assert BRDFS["lambert"].has_reference


def test_an_edit_of_the_struct_shows_in_the_next_scene(models: Path, scene: Path) -> None:
    glshade.load(scene, models=models)
    (models / "slate.glsl").write_text(SLATE.replace("gain", "strength"))
    loaded = glshade.load(scene, {"objects.0.material.strength": 2})
    assert loaded.objects[0].material.strength == 2  # type: ignore[union-attr]


def test_a_python_file_makes_it_an_ordinary_model(tmp_path: Path) -> None:
    use_models(write_models(tmp_path / "models"))
    assert BRDFS["chalk"].has_reference


@pytest.mark.parametrize(
    ("old", "new", "line", "says"),
    [
        ("float bare;", "int bare;", 7, "vec3 NAME"),
        ("float bare;", "float bare[2];", 7, "vec3 NAME"),
        ("float bare;", "float alpha;", 7, '"alpha"'),
        ("[0, inf]", "[0 inf]", 5, "no declaration"),
        ("[0, inf]", "[2, 1]", 5, "within the range"),
        ("default 1 ", "default -1 ", 5, "within the range"),
        ("default 1 ", "default [1, 1, 1] ", 5, "one number"),
        ("struct Slate", "struct Slates", None, "no struct Slate"),
    ],
)
def test_a_fault_of_the_struct_has_its_place(
    old: str, new: str, line: int | None, says: str, models: Path, scene: Path
) -> None:
    path = models / "slate.glsl"
    path.write_text(SLATE.replace(old, new))
    with pytest.raises(ShaderError) as caught:
        glshade.load(scene, models=models)
    assert str(caught.value).startswith(f"{path}:{line}: " if line else f"{path}: ")
    assert says in str(caught.value)
    # A mend clears the fault.
    path.write_text(SLATE)
    glshade.load(scene, models=models)
