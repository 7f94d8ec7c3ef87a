"""Property: the contracts hold on OSMesa too. A process has one backend, so the tests run in another process."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glshade import load
from glshade.image.file import read

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
# The models' GLSL is compared for the model with the most lobes and for an anisotropic model. The light loops are compared for
# one type of light. The slow test runs all contract tests for all models and lights.
FIRST = ("gpu_equals_reference", "extremes_many_lights")
FEW = "principled or ward_gmd or directional"
SCENES = ("gallery", "half-angle", "spot")
SIZE = (192, 108)


@pytest.fixture(scope="module")
def osmesa(glshade: Any) -> dict[str, Any]:
    """Returns the report of `glshade doctor` on OSMesa. Tests that need OSMesa are skipped where it draws nothing."""
    report: dict[str, Any] = json.loads(glshade("doctor", "--json", "--backend", "osmesa").stdout)
    if not report["well"]:
        pytest.skip(f"no osmesa here: {report['error']}")
    return report


def contracts(*arguments: str, backend: str = "osmesa") -> subprocess.CompletedProcess[str]:
    """Runs pytest in a process of its own on another backend."""
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-m", "not slow", *arguments]
    environment = {**os.environ, "GLSHADE_TEST_BACKEND": backend}
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=900, env=environment)


def must_hold(*arguments: str) -> None:
    done = contracts(*arguments)
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-2000:]
    assert " passed" in done.stdout


def test_the_first_laws(osmesa: Any) -> None:
    must_hold(*(str(HERE / f"test_{law}.py") for law in FIRST), "-k", FEW)


@pytest.mark.slow
def test_all_laws(osmesa: Any) -> None:
    must_hold(str(HERE), f"--ignore={HERE / 'test_osmesa.py'}")


def test_it_is_osmesa_that_draws(osmesa: Any) -> None:
    """The fixture takes the backend that it is told, and does not fall back to another."""
    assert osmesa["opengl"]["backend"] == "osmesa"
    done = contracts(str(HERE / "test_extremes_horizon.py"), "-x", "-k", "lambert", backend="no such")
    assert done.returncode != 0
    assert "unknown backend 'no such'" in done.stdout


@pytest.fixture(scope="module")
def pictures(osmesa: Any, glshade: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Returns the folder with a picture of each scene, drawn by the command on OSMesa."""
    folder = tmp_path_factory.mktemp("osmesa")
    scenes = [ROOT / "scenes" / f"{scene}.toml" for scene in SCENES]
    size = "x".join(map(str, SIZE))
    done = glshade("render", *scenes, "--size", size, "--backend", "osmesa", "--jobs", "1", "-o", folder / "{scene}.png")
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.parametrize("name", SCENES)
def test_a_shipped_scene_has_the_same_bytes(name: str, osmesa: Any, pictures: Path, renderer: Any, tmp_path: Path) -> None:
    scene = load(ROOT / "scenes" / f"{name}.toml")
    scene = scene.model_copy(update={"film": scene.film.model_copy(update={"size": SIZE})})
    renderer.render(scene).save(tmp_path / "egl.png")
    egl, other = (read(path)[0] for path in (tmp_path / "egl.png", pictures / f"{name}.png"))
    assert np.ptp(egl[..., :3]) > 0.2
    driver = (renderer.context.renderer, renderer.context.version)
    if driver == (osmesa["opengl"]["renderer"], osmesa["opengl"]["version"]):
        assert np.array_equal(egl, other), "one driver behind two backends"
    else:
        assert np.mean(np.abs(egl - other) > 0.02) < 0.01
