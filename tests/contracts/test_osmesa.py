"""Law: the contracts hold on OSMesa too. One backend a process: they run in another one, where the renderer is OSMesa's."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glshade.image.file import read

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
# The laws of the models' GLSL and of the light loops; all the others are run where there is time.
FIRST = ("gpu_equals_reference", "extremes_many_lights")


TOLD: dict[str, dict[str, Any]] = {}


def doctor(glshade: Any, backend: str) -> dict[str, Any]:
    """What the driver says of itself; the test is skipped where it gives no picture."""
    if backend not in TOLD:
        TOLD[backend] = json.loads(glshade("doctor", "--json", "--backend", backend).stdout)
    told = TOLD[backend]
    if not told["well"]:
        pytest.skip(f"no {backend} here: {told['error']}")
    return told


def contracts(*arguments: str, backend: str = "osmesa") -> subprocess.CompletedProcess[str]:
    """pytest in a process of its own, on another backend."""
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-m", "not slow", *arguments]
    environment = {**os.environ, "GLSHADE_TEST_BACKEND": backend}
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=900, env=environment)


def must_hold(*arguments: str) -> None:
    done = contracts(*arguments)
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-2000:]
    assert " passed" in done.stdout


def test_the_first_laws(glshade: Any) -> None:
    doctor(glshade, "osmesa")
    must_hold(*(str(HERE / f"test_{law}.py") for law in FIRST))


@pytest.mark.slow
def test_all_laws(glshade: Any) -> None:
    doctor(glshade, "osmesa")
    must_hold(str(HERE), f"--ignore={HERE / 'test_osmesa.py'}")


def test_it_is_osmesa_that_draws(glshade: Any) -> None:
    """The fixture takes the backend it is told, and nothing falls back in silence."""
    assert doctor(glshade, "osmesa")["opengl"]["backend"] == "osmesa"
    done = contracts(str(HERE / "test_extremes_horizon.py"), "-x", backend="no such")
    assert done.returncode != 0
    assert "unknown backend 'no such'" in done.stdout


@pytest.mark.parametrize("scene", ["gallery", "half-angle", "spot"])
def test_a_shipped_scene_has_the_same_bytes(scene: str, glshade: Any, tmp_path: Path) -> None:
    told = [doctor(glshade, backend)["opengl"] for backend in ("egl", "osmesa")]
    pictures = []
    for backend in ("egl", "osmesa"):
        file = tmp_path / f"{backend}.png"
        done = glshade("render", ROOT / "scenes" / f"{scene}.toml", "--size", "192x108", "--backend", backend, "-o", file)
        assert done.returncode == 0, done.stderr
        pictures.append(read(file)[0])
    assert np.ptp(pictures[0][..., :3]) > 0.2
    if (told[0]["renderer"], told[0]["version"]) == (told[1]["renderer"], told[1]["version"]):
        assert np.array_equal(*pictures), "one driver behind two doors"
    else:
        assert np.mean(np.abs(pictures[0] - pictures[1]) > 0.02) < 0.01
