"""Speed: measures how long `glshade compare` takes, as a user runs it: as a command that compares files."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from glshade.bench.corpus.case import driver_attributes, write_pixels
from glshade.bench.corpus.scenes import SCENES
from glshade.gl.renderer import Renderer
from glshade.scene.scene import Scene

# The number of pairs, and the width and height of their pictures [pixels].
PAIRS, SIDE = 1000, 1024
# The share of the pixels in which the pictures of a pair differ, each by one code in every channel.
CHANGED = 0.05
# The number of different pairs of files; the others are links to them. Decoding takes the same time for a link.
FILES = 4
# Width and height of the picture of a scene [pixels], and the subdivisions of its sphere, which has 20 * 4^5 triangles.
SCENE_SIDE, SUBDIVISIONS = 512, 5
# The time between two looks at the memory of a command [s].
LOOK = 0.02
# The targets on two cores [s].
CHANGED_SECONDS, SAME_SECONDS, SCENE_SECONDS = 60.0, 15.0, 2.5


@dataclass(frozen=True)
class Timing:
    """The time of one command.

    what: what is compared.
    seconds: its time, from the start of the process to its end [s].
    target: the most that it should take [s]; it is scaled with the number of pairs.
    megabytes: the most memory that it held at a time [MB].
    code: its exit code.
    """

    what: str
    seconds: float
    target: float
    megabytes: float
    code: int


@dataclass(frozen=True)
class Speed:
    """The times of all commands. driver: OpenGL's names of the driver that drew the pictures."""

    driver: str
    timings: tuple[Timing, ...]

    def table(self) -> tuple[list[str], list[list[str]]]:
        """Returns the heads and the rows of a table."""
        rows = [
            [t.what, f"{t.seconds:.2f}", f"{t.target:g}", f"{t.seconds / t.target:.2f}", f"{t.megabytes:.0f}", str(t.code)]
            for t in self.timings
        ]
        return ["compared", "seconds", "target", "share of the target", "megabytes", "exit code"], rows

    def as_dict(self) -> dict[str, Any]:
        """Returns the times as JSON types."""
        return asdict(self)


def measure_speed(pairs: int = PAIRS) -> Speed:
    """Measures comparisons of folders with this many pairs, and of a picture with its scene. Errors: ContextError, OSError."""
    with TemporaryDirectory(prefix="glshade-bench-") as name:
        folder = Path(name)
        with Renderer() as renderer:
            driver = " ".join(driver_attributes(renderer).values())
            files = _drawn_pairs(renderer, folder)
            scene, reference, tests = _drawn_scene(renderer, folder)
        timings = []
        for count in sorted({max(1, pairs // 10), pairs}):
            for what, same, target in (("5 % changed", False, CHANGED_SECONDS), ("the same bytes", True, SAME_SECONDS)):
                left, right = _folders(folder / f"{count}-{same}", files, count, same)
                label = f"{count} pairs of {SIDE} x {SIDE}, {what}"
                timings.append(_timed(label, target * count / PAIRS, str(left), str(right)))
        label = f"a pair of {SCENE_SIDE} x {SCENE_SIDE} with a scene of 20,480 triangles, "
        for what, test in tests.items():
            timings.append(_timed(label + what, SCENE_SECONDS, str(reference), str(test), "--scene", str(scene)))
    return Speed(driver, tuple(timings))


def _timed(what: str, target: float, *arguments: str) -> Timing:
    """Runs `glshade compare` and returns its time, its memory and its exit code."""
    start, most = time.perf_counter(), 0.0
    process = subprocess.Popen([sys.executable, "-m", "glshade", "compare", *arguments], stdout=subprocess.DEVNULL)
    while True:
        try:
            code = process.wait(timeout=LOOK)
        except subprocess.TimeoutExpired:
            most = max(most, _memory(process.pid))
            continue
        return Timing(what, time.perf_counter() - start, target, most, code)


def _memory(process: int) -> float:
    """Returns the most memory that a process has held so far [MB]; 0 where the system does not tell."""
    # resource.getrusage would count what this process held when it started the other.
    try:
        lines = Path(f"/proc/{process}/status").read_text().splitlines()
    except OSError:
        return 0.0
    return max((int(line.split()[1]) * 1024 / 1e6 for line in lines if line.startswith("VmHWM")), default=0.0)


def _drawn_pairs(renderer: Renderer, folder: Path) -> list[tuple[Path, Path]]:
    """Draws FILES pictures and their changed copies, and returns the paths."""
    random = np.random.default_rng(0)
    pairs = []
    for number, name in enumerate(["rates", "falloffs", "metals", "crowd"][:FILES]):
        scene = Scene.model_validate({**SCENES[name](), "film": {"size": (SIDE, SIDE)}})
        pixels = renderer.render(scene).pixels.copy()
        changed = pixels.copy()
        where = random.random(pixels.shape[:2]) < CHANGED
        # A code of 255 becomes 254, and all others one more.
        changed[where] += np.where(pixels[where] == 255, 255, 1).astype(np.uint8)
        paths = folder / f"{number}-reference.png", folder / f"{number}-test.png"
        for path, values in zip(paths, (pixels, changed), strict=True):
            write_pixels(path, values, driver_attributes(renderer))
        pairs.append(paths)
    return pairs


def _folders(folder: Path, files: Sequence[tuple[Path, Path]], count: int, same: bool) -> tuple[Path, Path]:
    """Makes two folders with `count` links or copies each, and returns them. same: whether both hold the references."""
    sides = folder / "reference", folder / "test"
    for side in sides:
        side.mkdir(parents=True)
    for number in range(count):
        reference, test = files[number % len(files)]
        for side, source in zip(sides, (reference, reference if same else test), strict=True):
            target = side / f"{number:05}.png"
            try:
                os.link(source, target)
            except OSError:
                # Not every file system has links.
                shutil.copyfile(source, target)
    return sides


def _drawn_scene(renderer: Renderer, folder: Path) -> tuple[Path, Path, dict[str, Path]]:
    """Draws a scene of one sphere. Returns the scene's file, its picture, and test pictures by what is wrong in them."""
    path = folder / "scene.json"
    ball = {"shape": {"type": "icosphere", "subdivisions": SUBDIVISIONS}, "material": {"brdf": "phong", "kd": [0.6, 0.2, 0.1]}}
    document = {
        "objects": [ball],
        "lights": [{"type": "directional", "direction": [-1, -1, -2], "intensity": 2.0}],
        "film": {"size": [SCENE_SIDE, SCENE_SIDE]},
        "camera": {"eye": [0, 0, 4], "target": [0, 0, 0]},
    }
    path.write_text(json.dumps(document), encoding="utf-8")
    pixels = renderer.render(Scene.model_validate(document)).pixels.copy()
    right = pixels.copy()
    right[::7, ::5] = np.where(right[::7, ::5] == 255, 254, right[::7, ::5] + 1)
    pictures = {"baseline": pixels, "by at most one code": right, "twice as dark": pixels // 2}
    for name, values in pictures.items():
        write_pixels(folder / f"{name}.png", values, driver_attributes(renderer))
    return path, folder / "baseline.png", {name: folder / f"{name}.png" for name in list(pictures)[1:]}
