"""Fixtures that all tests share: one OpenGL context a process, and an empty cache folder in place of the user's."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import hypothesis
import pytest

from glshade import Renderer, Scene

# A first compile, a first draw: single examples are slow now and then, and say nothing about the code.
hypothesis.settings.register_profile(
    "glshade", deadline=None, suppress_health_check=[hypothesis.HealthCheck.function_scoped_fixture], max_examples=50
)
hypothesis.settings.load_profile("glshade")


@pytest.fixture(scope="session", autouse=True)
def cache_folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The user's cache folder, empty at first; commands that tests start have it too."""
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("cache")
        patch.setenv("XDG_CACHE_HOME", str(folder))
        yield folder


@pytest.fixture(scope="session")
def renderer() -> Iterator[Renderer]:
    # test_osmesa.py runs the contracts on another backend, in a process of its own.
    backend: Any = os.environ.get("GLSHADE_TEST_BACKEND", "auto")
    with Renderer(backend) as renderer:
        yield renderer


@pytest.fixture(autouse=True)
def free_gl_objects(request: pytest.FixtureRequest) -> Iterator[None]:
    """Frees the programs, textures and buffers that a test leaves behind.

    moderngl keeps what Python has dropped until gc() is called. Many tests link programs of their own, and a worker process
    that runs thousands of them would grow to several GB.
    """
    used = request.getfixturevalue("renderer") if "renderer" in request.fixturenames else None
    yield
    if used is not None:
        with used.context.gl as gl:
            gl.gc()


class Picture:
    """A scene in a few words, drawn: `draw(objects, lights, camera=..., film=...)` gives linear float32 pixels, a copy."""

    def __init__(self, renderer: Renderer) -> None:
        self.renderer = renderer

    def scene(self, objects: Any, lights: Any = None, size: tuple[int, int] = (32, 32), **more: Any) -> Scene:
        objects = [objects] if isinstance(objects, Mapping) else objects
        film = {"size": size, **more.pop("film", {})}
        return Scene.model_validate({"objects": objects, "lights": lights, "film": film, **more})

    def __call__(self, objects: Any, lights: Any = None, size: tuple[int, int] = (32, 32), **more: Any) -> Any:
        options = {key: more.pop(key) for key in ("dtype", "shading", "tile") if key in more}
        options.setdefault("dtype", "float32")
        return self.renderer.render(self.scene(objects, lights, size, **more), **options).pixels.copy()


@pytest.fixture(scope="session")
def draw(renderer: Renderer) -> Picture:
    return Picture(renderer)


@pytest.fixture(scope="session")
def glshade() -> Any:
    """`glshade(*arguments)` runs the command as a user would, in a process of its own."""

    def run(*arguments: object, cwd: Path | None = None, **environment: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "glshade", *map(str, arguments)]
        return subprocess.run(
            command, capture_output=True, text=True, cwd=cwd, timeout=120, env={**os.environ, **environment}, check=False
        )

    return run


@pytest.fixture(scope="session")
def python() -> Any:
    """`python(code)` runs code in a process of its own, warnings being errors; returns what it printed."""

    def run(code: str, *arguments: object, cwd: Path | None = None, **environment: str) -> str:
        command = [sys.executable, "-W", "error", "-c", code, *map(str, arguments)]
        done = subprocess.run(
            command, capture_output=True, text=True, cwd=cwd, timeout=120, env={**os.environ, **environment}, check=False
        )
        assert done.returncode == 0, f"exit code {done.returncode}: {done.stderr}"
        return done.stdout.strip()

    return run
