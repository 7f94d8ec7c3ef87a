"""A batch that gets a signal at any moment loses no finished picture, and --resume completes it to the same bytes.

Each input is a batch that gets one to three of SIGINT, SIGTERM, SIGHUP and SIGKILL at random moments, each in a run of its own,
and is then resumed.
"""

from __future__ import annotations

import json
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SCENE = """
objects = [ { shape = "sphere", material = { brdf = "phong" } } ]
animation = [ { key = "camera.turn", frames = [1, 13], values = [0, 360] } ]
[film]
size = [96, 64]
"""
FRAMES = 12
COUNT = 60
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGKILL)
PATIENCE = 120.0


def prove(count: int, seed: int) -> int:
    """Disturbs batches, and returns how many of them ended in the wrong way."""
    chance = random.Random(seed)
    broken = 0
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        (folder / "s.toml").write_text(SCENE)
        begin = time.monotonic()
        start(folder, "undisturbed", 1).communicate(timeout=PATIENCE)
        duration = time.monotonic() - begin
        expected = pictures(folder / "undisturbed")
        assert len(expected) == FRAMES
        for index in range(count):
            jobs, signals = chance.choice((1, 2)), [chance.choice(SIGNALS) for _ in range(chance.randint(1, 3))]
            problem = wrong(folder, f"out-{index}", jobs, signals, expected, chance, duration)
            if problem:
                print(f"{jobs} jobs, {', '.join(number.name for number in signals)}: {problem}", flush=True)
                broken += 1
    return broken


def start(folder: Path, out: str, jobs: int) -> subprocess.Popen[str]:
    """Starts a batch that writes to the folder `out`."""
    command = [sys.executable, "-m", "glshade", "render", "s.toml", "-f", f"1-{FRAMES}", "-o", f"{out}/f.##.png"]
    return subprocess.Popen(
        [*command, "--jobs", str(jobs), "--resume"],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def pictures(out: Path) -> dict[str, bytes]:
    """Returns the pictures of a batch: name -> bytes. The names of temporary files begin with a dot and do not match."""
    return {path.name: path.read_bytes() for path in out.glob("f.*.png")}


def wrong(
    folder: Path,
    out: str,
    jobs: int,
    signals: list[signal.Signals],
    expected: dict[str, bytes],
    chance: random.Random,
    duration: float,
) -> str:
    """Sends a batch the signals, each to another run of it, resumes it, and returns what was wrong; "" if all was well.

    duration: the time that the batch takes without a disturbance [s].
    """
    for number in signals:
        process = start(folder, out, jobs)
        time.sleep(chance.uniform(0, duration))
        workers = children(process.pid)
        process.send_signal(number)
        _, errors = process.communicate(timeout=PATIENCE)
        # Until its modules are imported, Python itself answers SIGINT, with a traceback.
        if "Traceback" in errors and number != signal.SIGINT:
            return f"after {number.name}: {errors[-500:]}"
        wait_for_end(workers)
        found = pictures(folder / out)
        if any(data != expected[name] for name, data in found.items()):
            return f"after {number.name}, a picture is damaged"
    process = start(folder, out, jobs)
    _, errors = process.communicate(timeout=PATIENCE)
    names = sorted(path.name for path in (folder / out).iterdir())
    if process.returncode or errors:
        return f"resumed: exit code {process.returncode}: {errors[-500:]}"
    if names != sorted([*expected, "manifest.jsonl"]):
        return f"resumed: the folder holds {names}"
    if pictures(folder / out) != expected:
        return "resumed: the pictures differ"
    lines = [json.loads(line) for line in (folder / out / "manifest.jsonl").read_text().splitlines()]
    last = {line["output"]: line["state"] for line in lines}
    return "" if last == dict.fromkeys(expected, "done") else f"resumed: the manifest says {last}"


def children(process: int) -> list[int]:
    """Returns the processes that a process has started."""
    try:
        return [int(word) for word in Path(f"/proc/{process}/task/{process}/children").read_text().split()]
    except OSError:
        return []


def wait_for_end(processes: list[int]) -> None:
    """Waits until none of the processes is running. Errors: TimeoutError."""
    deadline = time.monotonic() + PATIENCE
    while any(Path(f"/proc/{number}").exists() for number in processes):
        if time.monotonic() > deadline:
            raise TimeoutError("a worker still runs after its parent has ended")
        time.sleep(0.01)
