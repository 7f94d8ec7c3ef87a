"""Model folders: reflectance models and lights of the user's own, known everywhere once their folder is named."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.folders import CHALK, CHALK_GLSL, SCENE, SHARED, VALUE, ZENITH, forget_models, write_models

import glshade
from glshade import BRDFS, LIGHTS, Renderer, Scene
from glshade.errors import SceneError
from glshade.scene import models
from glshade.scene.models import models_digest, use_models

Fault = Callable[[Path], object]


@pytest.fixture(autouse=True)
def nothing_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each test starts without model folders, and what it adds is forgotten afterwards."""
    forget_models(monkeypatch)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a reflectance model, a file that it shares, and a light."""
    return write_models(tmp_path / "models")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A scene with that model and that light."""
    path = tmp_path / "s.toml"
    path.write_text(SCENE)
    return path


def test_a_scene_may_name_what_a_folder_has(folder: Path, path: Path) -> None:
    with pytest.raises(SceneError, match="chalk"):
        glshade.load(path)
    scene = glshade.load(path, models=folder)
    assert "chalk" in BRDFS
    assert "zenith" in LIGHTS
    with Renderer() as renderer:
        pixels = renderer.render(scene, dtype="float32").pixels
        assert np.allclose(pixels, VALUE, rtol=1e-6)
        assert glshade.verify(scene, renderer=renderer).verdict == "verified"
        values = [glshade.evaluate(BRDFS["chalk"](), [0, 0.6, 0.8], [0, 0, 1], "reference")]
        values += [
            glshade.evaluate(BRDFS["chalk"](), [0, 0.6, 0.8], [0, 0, 1], on, renderer.context)  # type: ignore[arg-type]
            for on in ("vertex", "fragment")
        ]
    assert np.allclose(values, 0.32, rtol=1e-6)
    assert str(glshade.explain(scene)).count("chalk") > 0


@pytest.mark.parametrize("caller", ["use_models", "load", "Renderer", "verify", "evaluate", "render"])
def test_whoever_takes_a_folder_makes_it_known(caller: str, folder: Path, path: Path) -> None:
    plain = Scene.model_validate({"objects": [{"shape": "plane"}], "film": {"size": [4, 4]}})
    if caller == "use_models":
        use_models([folder])
    elif caller == "load":
        glshade.load(path, models=[folder])
    elif caller == "Renderer":
        Renderer(models=folder).release()
    elif caller == "verify":
        glshade.verify(plain, models=folder)
    elif caller == "evaluate":
        glshade.evaluate(BRDFS["lambert"](), [0, 0, 1], [0, 0, 1], models=folder)
    else:
        glshade.render(plain, models=folder)
    assert glshade.load(path).lights[0].type == "zenith"


def test_an_edit_of_its_glsl_shows_in_the_next_picture(folder: Path, path: Path) -> None:
    scene = glshade.load(path, models=folder)
    with Renderer() as renderer:
        assert np.allclose(renderer.render(scene, dtype="float32").pixels, VALUE, rtol=1e-6)
        (folder / "chalk.glsl").write_text(CHALK_GLSL.replace("(NoL * NoL)", "(0.5 * NoL * NoL)"))
        assert np.allclose(renderer.render(scene, dtype="float32").pixels, VALUE / 2, rtol=1e-6)


def test_a_shader_folder_comes_before_a_model_folder(folder: Path, path: Path, tmp_path: Path) -> None:
    own = tmp_path / "own"
    (own / "brdf").mkdir(parents=True)
    (own / "brdf" / "chalk.glsl").write_text(CHALK_GLSL.replace("(NoL * NoL)", "(0.5 * NoL * NoL)"))
    with Renderer(shaders=own, models=folder) as renderer:
        pixels = renderer.render(glshade.load(path), dtype="float32").pixels
    assert np.allclose(pixels, VALUE / 2, rtol=1e-6)


def test_a_folder_is_run_once(folder: Path) -> None:
    use_models(folder)
    known = BRDFS["chalk"]
    use_models([folder, folder])
    assert BRDFS["chalk"] is known


def test_the_digest_tells_python_files_and_not_places(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def digest(of: Path) -> str:
        monkeypatch.setattr(models, "_folders", {})
        for name in ("chalk", "zenith"):
            for found in (BRDFS, LIGHTS):
                monkeypatch.setattr(found, "_names", [known for known in found if known != name])
        use_models(of)
        return models_digest()

    without = models_digest()
    before = digest(folder)
    moved = shutil.copytree(folder, tmp_path / "moved", ignore=shutil.ignore_patterns("__pycache__"))
    assert digest(moved) == before != without
    (moved / "_shared.py").write_text(SHARED + "# edited\n")
    assert digest(moved) != before


def test_two_folders_may_have_files_of_one_name(folder: Path, tmp_path: Path) -> None:
    """A model imports the neighbours of its own folder."""
    other = tmp_path / "other"
    other.mkdir()
    (other / "slate.py").write_text(CHALK.replace("Chalk", "Slate").replace("chalk", "slate"))
    (other / "slate.glsl").write_text(CHALK_GLSL.replace("Chalk", "Slate"))
    (other / "_shared.py").write_text("def squared(x):\n    return 0.5 * x**2\n")
    use_models([folder, other])
    values = [glshade.evaluate(BRDFS[name](), [0, 0, 1], [0, 0, 1]) for name in ("chalk", "slate")]
    assert np.allclose(values, [[0.5] * 3, [0.25] * 3])


def _remove(name: str) -> Fault:
    return lambda folder: (folder / name).unlink()


def _write(name: str, text: str) -> Fault:
    return lambda folder: (folder / name).write_text(text)


@pytest.mark.parametrize(
    ("fault", "file", "says"),
    [
        (shutil.rmtree, "", "is not a folder"),
        (lambda folder: [file.unlink() for file in folder.glob("*.*")], "", "has no models"),
        (_write("zenith.py", "class ZenithLight(:\n"), "zenith.py", "SyntaxError"),
        (_write("zenith.py", "import no_such_module\n"), "zenith.py", "ModuleNotFoundError"),
        (_write("zenith.py", "raise ValueError('one\\ntwo')\n"), "zenith.py", "ValueError: one two"),
        (_write("zenith.py", "class Zenith:\n    pass\n"), "zenith.py", "class ZenithLight"),
        (_write("zenith.py", "Zenith = 1\n"), "zenith.py", "class ZenithLight"),
        (_write("zenith.py", ""), "zenith.py", "class ZenithLight"),
        (_remove("zenith.glsl"), "zenith.py", "has no zenith.glsl beside it"),
        (lambda folder: [_rename(folder, suffix) for suffix in ("py", "glsl")], "point.py", 'the name "point" is taken'),
    ],
    ids=["no folder", "no models", "syntax", "import", "lines", "no model", "no class", "empty", "no GLSL", "name taken"],
)
def test_a_fault_is_one_line_that_names_the_file(fault: Fault, file: str, says: str, folder: Path, path: Path) -> None:
    fault(folder)
    with pytest.raises(SceneError) as error:
        use_models(folder)
    message = str(error.value)
    assert message.startswith(f"{folder / file}: ")
    assert says in message
    assert "\n" not in message
    # Nothing of the folder is known, so that it may be named again once the fault is mended.
    assert "chalk" not in BRDFS
    assert models.model_folders() == ()


def _rename(folder: Path, suffix: str) -> None:
    """Gives the light's file the name of a light that ships with glshade."""
    old = folder / f"zenith.{suffix}"
    old.with_stem("point").write_text(old.read_text().replace("ZenithLight", "PointLight"))
    old.unlink()


def test_a_mended_folder_is_read_again(folder: Path, path: Path) -> None:
    _write("zenith.py", "class ZenithLight(:\n")(folder)
    with pytest.raises(SceneError):
        use_models(folder)
    _write("zenith.py", ZENITH)(folder)
    assert glshade.load(path, models=folder).lights[0].type == "zenith"


def test_what_takes_a_folder_tells_its_faults(tmp_path: Path, path: Path) -> None:
    nowhere = tmp_path / "nowhere"
    plain = Scene.model_validate({"objects": [{"shape": "plane"}], "film": {"size": [4, 4]}})
    callers: list[Callable[[], Any]] = [
        lambda: glshade.load(path, models=nowhere),
        lambda: Renderer(models=nowhere),
        lambda: glshade.verify(plain, models=nowhere),
        lambda: glshade.evaluate(BRDFS["lambert"](), [0, 0, 1], [0, 0, 1], models=nowhere),
    ]
    for call in callers:
        with pytest.raises(SceneError, match="nowhere: is not a folder"):
            call()
