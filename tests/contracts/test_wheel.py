"""Property: the wheel holds all that glshade needs. Installed somewhere else, it works without the checkout."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
import sysconfig
from collections.abc import Callable
from pathlib import Path

import pytest
from support.folders import SCENE, write_models

from glshade.image.file import read

ROOT = Path(__file__).parents[2]
Run = Callable[..., str]

pytestmark = pytest.mark.slow


def called(*command: object, cwd: Path | None = None, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        list(map(str, command)), capture_output=True, text=True, cwd=cwd, env={**os.environ, **environment}, check=False
    )


@pytest.fixture(scope="module")
def fresh(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Returns a virtual environment with the wheel. All its other packages are those of the current environment."""
    folder = tmp_path_factory.mktemp("wheel")
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "-q"]
    backend = folder / "hatchling"
    if importlib.util.find_spec("hatchling") is None:
        done = called(*pip, "install", "--target", backend, "hatchling>=1.27")
        if done.returncode:
            pytest.skip(f"hatchling, which builds the wheel, is not installed and pip cannot get it: {done.stderr[-300:]}")
    options = ("--no-deps", "--no-build-isolation", "-w", folder)
    done = called(*pip, "wheel", *options, ROOT, cwd=folder, PYTHONPATH=str(backend))
    assert done.returncode == 0, done.stderr
    [wheel] = folder.glob("glshade-*.whl")
    environment = folder / "environment"
    done = called(sys.executable, "-m", "venv", "--without-pip", environment)
    assert done.returncode == 0, done.stderr
    done = called(*pip, "--python", environment / "bin" / "python", "install", "--no-deps", "--no-index", wheel)
    assert done.returncode == 0, done.stderr
    # The .pth files in that folder, such as the checkout's own, are not read; only the folder itself is on the path, and last.
    [packages] = environment.glob("lib/python*/site-packages")
    (packages / "others.pth").write_text(sysconfig.get_path("purelib"))
    return environment


@pytest.fixture
def run(fresh: Path, tmp_path: Path) -> Run:
    """`run(*arguments)` calls the installed command in a folder with a scene and its models, and returns its stdout."""
    (tmp_path / "s.toml").write_text(SCENE)
    write_models(tmp_path / "models")

    def run(*arguments: object) -> str:
        done = called(fresh / "bin" / "glshade", *arguments, cwd=tmp_path, PYTHONPATH="")
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


def test_it_is_the_wheel_that_runs(fresh: Path, tmp_path: Path) -> None:
    code = "import glshade; from glshade.glsl.shaders import SHIPPED; print(glshade.__file__); print(SHIPPED)"
    done = called(fresh / "bin" / "python", "-P", "-c", code, cwd=tmp_path, PYTHONPATH="")
    assert done.returncode == 0, done.stderr
    for place in done.stdout.splitlines():
        assert Path(place).is_relative_to(fresh)


def test_it_has_the_data_of_the_checkout(fresh: Path) -> None:
    [package] = fresh.glob("lib/python*/site-packages/glshade")
    for here, there in (("_shaders", "shaders"), ("_scenes", "scenes")):
        names = {path.relative_to(ROOT / there) for path in (ROOT / there).rglob("*") if path.is_file()}
        assert names <= {path.relative_to(package / here) for path in (package / here).rglob("*")}
    modules = {path.relative_to(ROOT / "glshade") for path in (ROOT / "glshade").rglob("*") if path.suffix != ".pyc"}
    assert {path for path in modules if "__pycache__" not in path.parts} <= {
        path.relative_to(package) for path in package.rglob("*")
    }


def test_render_and_verify(run: Run, tmp_path: Path) -> None:
    run("render", "s.toml", "-o", "x.png", "--models", "models")
    assert read(tmp_path / "x.png")[0][..., :3].max() > 0.5
    assert "verified" in run("verify", "s.toml", "--models", "models")
    (tmp_path / "plain.toml").write_text('objects = [{ shape = "sphere", material = "gold" }]\nfilm = { size = [24, 16] }\n')
    assert "verified" in run("verify", "plain.toml")


def test_a_batch_in_worker_processes(run: Run, tmp_path: Path) -> None:
    run("render", "s.toml", "--sweep", "lights.0.intensity=1,0.5", "-o", "{intensity}.exr", "--jobs", "2", "--models", "models")
    assert len(list(tmp_path.glob("*.exr"))) == 2


@pytest.mark.skipif(importlib.util.find_spec("distributed") is None, reason="distributed is not installed")
def test_a_batch_on_a_cluster(run: Run, tmp_path: Path) -> None:
    options = ("-o", "{intensity}.exr", "--cluster", "local", "--jobs", "2", "--models", "models")
    run("render", "s.toml", "--sweep", "lights.0.intensity=1,0.5", *options)
    assert len(list(tmp_path.glob("*.exr"))) == 2


def test_explain(run: Run) -> None:
    said = run("explain", "s.toml", "--census", "--models", "models")
    assert "chalk per pixel" in said
    assert "fragment operations" in said
