"""Noise of drivers: pictures of a scene by several drivers, thread counts and vector widths raise no alarm."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from glshade.golden.judge import compare_files
from glshade.golden.result import Outcome
from glshade.golden.rules.codes import Codes
from glshade.golden.scene_judge import SceneJudge

# Scenes with smooth shading, with textures and with outlines of small objects, and the size of their pictures.
SCENES, SIZE = ("gallery", "detail", "perspective-viewer"), (192, 108)
# Name -> the environment and the options with which the picture is drawn again. softpipe draws one sample even where more are
# asked for, which another driver shows as other outlines all over the picture, so it is compared with one sample.
DRIVERS: dict[str, tuple[dict[str, str], tuple[str, ...]]] = {
    "OSMesa": ({}, ("--backend", "osmesa")),
    "softpipe": ({"GALLIUM_DRIVER": "softpipe"}, ("--samples", "1")),
    "no threads": ({"LP_NUM_THREADS": "0"}, ()),
    "one thread": ({"LP_NUM_THREADS": "1"}, ()),
    "two threads": ({"LP_NUM_THREADS": "2"}, ()),
    "vectors of 128 bits": ({"LP_NATIVE_VECTOR_WIDTH": "128"}, ()),
}

pytestmark = pytest.mark.slow


def draw(path: Path, scene: str, environment: dict[str, str], options: tuple[str, ...]) -> None:
    """Draws a shipped scene in another process. The test is skipped where the driver is missing or fails."""
    size = ["--size", "{}x{}".format(*SIZE)]
    command = [sys.executable, "-m", "glshade", "render", f"scenes/{scene}.toml", "-o", str(path), *size, *options]
    done = subprocess.run(command, env={**os.environ, **environment}, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(f"the driver cannot draw the scene: code {done.returncode}, {done.stderr.strip()[-200:]}")


@pytest.mark.parametrize("driver", DRIVERS)
@pytest.mark.parametrize("scene", SCENES)
def test_other_drivers_raise_no_alarm(scene: str, driver: str, tmp_path: Path) -> None:
    one_sample = ("--samples", "1") if driver == "softpipe" else ()
    samples = [("film.samples", "1")] if one_sample else []
    judge = SceneJudge(Path(f"scenes/{scene}.toml"), [("film.size", str(list(SIZE))), *samples])
    for suffix in (".png", ".exr"):
        reference, test = tmp_path / f"ref{suffix}", tmp_path / f"test{suffix}"
        draw(reference, scene, {}, one_sample)
        draw(test, scene, *DRIVERS[driver])
        result = compare_files(reference, test, Codes(), scenes=judge)
        assert result.outcome is Outcome.SAME, f"{suffix}: {result.reason} {result.causes}"
