"""On a full disk, a batch stops and says why; no picture is cut short, and --resume completes the batch once there is room.

Every picture format is tried on disks that are full after different numbers of bytes. On every other disk the cache folder
lies, too, so that also the caches of glshade and of the driver are full.
"""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

from support.disk import NoDisk, resize, small_disk

from glshade.image.formats import FORMATS

SCENE = """
objects = [ { shape = "sphere", material = { brdf = "phong" } } ]
animation = [ { key = "camera.turn", frames = [1, 7], values = [0, 360] } ]
[film]
size = [160, 120]
"""
FRAMES = 6
SUFFIXES = sorted(FORMATS)
# The number of disks that are tried for each format.
SIZES = 8
COUNT = len(SUFFIXES) * SIZES
# The room on the smallest disk, on the largest small one, and on the one where everything fits [bytes].
SMALLEST, LARGEST, ENOUGH = 1 << 12, 1 << 19, 1 << 26
PATIENCE = 120.0


def prove(count: int, seed: int) -> int:
    """Tries small disks, and returns on how many of them a batch ended in the wrong way."""
    chance = random.Random(seed)
    broken = 0
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        (folder / "s.toml").write_text(SCENE)
        expected: dict[str, dict[str, bytes]] = {}
        for index in range(count):
            suffix = SUFFIXES[index % len(SUFFIXES)]
            if suffix not in expected:
                render(folder, folder / suffix, suffix, 1, folder / "cache")
                expected[suffix] = pictures(folder / suffix)
                assert len(expected[suffix]) == FRAMES
            size = round(SMALLEST * (LARGEST / SMALLEST) ** chance.random())
            jobs, with_cache = chance.choice((1, 2)), chance.random() < 0.5
            try:
                with small_disk(folder / f"disk-{index}", size) as disk:
                    cache = disk / "cache" if with_cache else folder / "cache"
                    problem = wrong(disk, expected[suffix], partial(render, folder, disk / "out", suffix, jobs, cache))
            except NoDisk as error:
                print(f"nothing is proved: {error}")
                return 0
            if problem:
                place = "with" if with_cache else "without"
                print(f"{suffix}, {size} bytes, {jobs} jobs, {place} the cache on the disk: {problem}", flush=True)
                broken += 1
    return broken


def render(folder: Path, out: Path, suffix: str, jobs: int, cache: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """Runs a batch that writes to the folder `out`."""
    command = [sys.executable, "-m", "glshade", "render", "s.toml", "-f", f"1-{FRAMES}", "-o", str(out / f"f.#.{suffix}")]
    environment = {**os.environ, "XDG_CACHE_HOME": str(cache)}
    return subprocess.run(
        [*command, "--jobs", str(jobs), *options],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )


def pictures(out: Path) -> dict[str, bytes]:
    """Returns the files of a batch's folder, except for the manifest: name -> bytes."""
    return {path.name: path.read_bytes() for path in out.glob("*") if path.name != "manifest.jsonl"}


def wrong(disk: Path, expected: dict[str, bytes], run: partial[subprocess.CompletedProcess[str]]) -> str:
    """Runs a batch until the disk is full, makes room, resumes the batch, and returns what was wrong; "" if all was well."""
    out = disk / "out"
    done = run("--resume")
    if done.returncode not in (0, 1) or "Traceback" in done.stderr:
        return f"exit code {done.returncode}: {done.stderr[-500:]}"
    if done.returncode == 1 and "No space left on device" not in done.stderr and "the disk full" not in done.stderr:
        return f"nothing says that the disk is full: {done.stderr[-500:]}"
    found = pictures(out)
    if any(data != expected.get(name) for name, data in found.items()):
        return f"wrong files: {sorted(name for name, data in found.items() if data != expected.get(name))}"
    if done.returncode == 0 and found != expected:
        return "exit code 0, and pictures are missing"
    resize(disk, ENOUGH)
    done = run("--resume")
    if done.returncode != 0 or pictures(out) != expected:
        return f"resumed: exit code {done.returncode}, {len(pictures(out))} files: {done.stderr[-500:]}"
    lines = [json.loads(line) for line in (out / "manifest.jsonl").read_text().splitlines()]
    last = {line["output"]: line["state"] for line in lines}
    return "" if last == dict.fromkeys(expected, "done") else f"resumed: the manifest says {last}"
