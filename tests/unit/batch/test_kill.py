"""A batch that is killed at any moment and resumed ends with the same files, and makes no picture twice."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path

import pytest

SCENE = """
objects = [ { shape = "sphere", material = { brdf = "phong" } } ]
animation = [ { key = "camera.turn", frames = [1, 21], values = [0, 360] } ]
[film]
size = [96, 64]
"""
PICTURES = 20
PATIENCE = 60.0

pytestmark = pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="children are looked up in /proc")


class Batch:
    """A command in a folder of its own, with the inode and time of each picture that was seen."""

    def __init__(self, folder: Path, *options: str) -> None:
        self.folder = folder
        self.options = options
        folder.mkdir()
        (folder / "s.toml").write_text(SCENE)
        self.seen: dict[str, tuple[int, int]] = {}

    def start(self) -> subprocess.Popen[str]:
        command = [sys.executable, "-m", "glshade", "render", "s.toml", "-f", f"1-{PICTURES}", "-o", "out/f.##.png"]
        return subprocess.Popen(
            [*command, "--jobs", "2", "--resume", *self.options],
            cwd=self.folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def finish(self) -> None:
        """Runs the command without disturbance, and checks its result."""
        process = self.start()
        _, errors = process.communicate(timeout=PATIENCE)
        assert (process.returncode, errors) == (0, "")
        self.look()
        self.check()

    def pictures(self) -> dict[str, Path]:
        # Names of incomplete files begin with a dot and do not match.
        return {path.name: path for path in sorted((self.folder / "out").glob("f.*.png"))}

    def look(self) -> None:
        """Checks that no picture seen before has been lost or made again."""
        now = {name: (path.stat().st_ino, path.stat().st_mtime_ns) for name, path in self.pictures().items()}
        again = {name for name, state in self.seen.items() if now.get(name) != state}
        assert not again, f"made again, or lost: {sorted(again)}"
        self.seen = now

    def check(self) -> None:
        """Checks that each picture exists with one line of the manifest, and that there are no other files."""
        names = [f"f.{frame:02d}.png" for frame in range(1, PICTURES + 1)]
        assert sorted(path.name for path in (self.folder / "out").iterdir()) == [*names, "manifest.jsonl"]
        lines = [json.loads(line) for line in (self.folder / "out" / "manifest.jsonl").read_text().splitlines()]
        assert {line["state"] for line in lines} == {"done"}
        assert Counter(line["output"] for line in lines) == Counter(names)


def children(process: int) -> list[int]:
    """Returns the processes that a process has started."""
    try:
        return [int(word) for word in Path(f"/proc/{process}/task/{process}/children").read_text().split()]
    except OSError:
        return []


def kill(process: int) -> None:
    with suppress(ProcessLookupError):
        os.kill(process, signal.SIGKILL)


def wait_for_end(processes: list[int]) -> None:
    deadline = time.monotonic() + PATIENCE
    while any(Path(f"/proc/{number}").exists() for number in processes):
        assert time.monotonic() < deadline, "a worker still runs after its parent was killed"
        time.sleep(0.005)


def disturb(batch: Batch, chance: random.Random, count: int) -> int:
    """Runs the batch once, kills workers and perhaps the parent, and returns the number of kills, at most `count`."""
    process = batch.start()
    assert process.stdout is not None
    kills = 0
    while kills < count:
        # Some kills happen during the start, most of them between pictures or during one.
        if chance.random() < 0.15:
            time.sleep(chance.uniform(0, 0.6))
        else:
            for _ in range(chance.randint(1, 3)):
                if not process.stdout.readline():
                    break
            time.sleep(chance.uniform(0, 0.02))
        workers = children(process.pid)
        if process.poll() is not None:
            break
        kills += 1
        if chance.random() < 0.5:
            kill(process.pid)
            process.communicate(timeout=PATIENCE)
            wait_for_end(workers)
            batch.look()
            return kills
        if workers:
            kill(chance.choice(workers))
    _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, errors
    batch.look()
    batch.check()
    return kills


def run(folder: Path, chance: random.Random, count: int, *options: str) -> None:
    """Runs batches with `count` kills in all, and compares their pictures with those of a batch without kills."""
    undisturbed = Batch(folder / "undisturbed", *options)
    undisturbed.finish()
    expected = {name: path.read_bytes() for name, path in undisturbed.pictures().items()}
    kills = rounds = 0
    while kills < count:
        batch = Batch(folder / f"round-{rounds}", *options)
        rounds += 1
        while len(batch.pictures()) < PICTURES and kills < count:
            kills += disturb(batch, chance, count - kills)
        batch.finish()
        assert {name: path.read_bytes() for name, path in batch.pictures().items()} == expected


def test_two_kills(tmp_path: Path) -> None:
    """A worker is killed, then the parent; the seed was chosen for that."""
    # A killed worker counts as a failed attempt of its pictures, so they need retries.
    run(tmp_path, random.Random(0), 2, "--retries", "4")


@pytest.mark.slow
def test_200_kills(tmp_path: Path) -> None:
    run(tmp_path, random.Random(200), 200, "--retries", "9")
