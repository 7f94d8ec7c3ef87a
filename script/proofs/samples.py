"""Sample n of a scene has the same bytes on 1, 2 and 3 workers, in another order, and after a batch was killed and resumed.

Each input is a sample of one scene, whose values are drawn at random in every way that [sample] knows. All samples are drawn by
one worker, and again by each number of workers in two orders. Each of these batches is killed once and then resumed.
"""

from __future__ import annotations

import json
import random
import subprocess
import sys
import tempfile
import time
from itertools import product
from pathlib import Path

from proofs.signals import PATIENCE, children, wait_for_end

COUNT = 500
SCENE = """
objects = [
    { name = "thing", shape = "sphere", material = { brdf = "ggx" } },
    { name = "floor", shape = "plane", transform = { translate = [0, -1, 0], scale = [4, 1, 4] }, material = "plaster" },
]
lights = [ { type = "directional", direction = [0, -1, -0.5] }, { type = "ambient", intensity = 0.3 } ]
[film]
size = [48, 32]
samples = 1
[sample]
seed = SEED
values = [
    { key = "objects.thing.material.roughness", uniform = [0.05, 1.0] },
    { key = "objects.thing.material.kd", choice = [[0.8, 0.1, 0.1], [0.1, 0.8, 0.1], [0.1, 0.1, 0.8]] },
    { key = "objects.thing.transform.translate", normal = [[0, 0, 0], [0.3, 0.1, 0.3]] },
    { key = "lights.0.intensity", log_uniform = [0.5, 4.0] },
]
views = { on = "hemisphere", pattern = "stratified", radius = [4, 8], count = 100 }
"""


def prove(count: int, seed: int) -> int:
    """Draws the samples, and returns how many of them differed in any of the batches."""
    chance = random.Random(seed)
    orders = {"forwards": f"1-{count}", "halves swapped": f"{count // 2 + 1}-{count},1-{count // 2}"}
    if count == 1:
        orders = {"forwards": "1"}
    wrong: set[str] = set()
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        (folder / "s.toml").write_text(SCENE.replace("SEED", str(seed)))
        finish(start(folder, "expected", orders["forwards"], 1))
        expected = results(folder / "expected")
        assert len(expected) == count
        assert all(drawn != "null" for _, drawn in expected.values()), "the manifest does not say what was drawn"
        assert len({picture for picture, _ in expected.values()}) > count // 2, "the samples look alike"
        for jobs, (order, frames) in product((1, 2, 3), orders.items()):
            out = f"{jobs} {order}"
            process = start(folder, out, frames, jobs)
            target = chance.randrange(count)
            while process.poll() is None and len(list((folder / out).glob("f.*.png"))) < target:
                time.sleep(0.01)
            workers = children(process.pid)
            process.kill()
            process.communicate(timeout=PATIENCE)
            wait_for_end(workers)
            before = len(list((folder / out).glob("f.*.png")))
            finish(start(folder, out, frames, jobs))
            found = results(folder / out)
            differing = {name for name in expected if found.get(name) != expected[name]}
            print(f"{jobs} workers, {order}, killed after {before} pictures: {len(differing)} differ", flush=True)
            wrong |= differing
    return len(wrong)


def start(folder: Path, out: str, frames: str, jobs: int) -> subprocess.Popen[str]:
    """Starts a batch that writes the samples `frames` to the folder `out`."""
    command = [sys.executable, "-m", "glshade", "render", "s.toml", "-f", frames, "-o", f"{out}/f.####.png", "--resume"]
    # A single picture has no manifest unless one is asked for.
    options = ["--jobs", str(jobs), "--manifest", f"{out}/manifest.jsonl"]
    return subprocess.Popen([*command, *options], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def finish(process: subprocess.Popen[str]) -> None:
    """Waits until a batch has ended without a fault. It may take 10 s, and half a second a picture on a busy machine."""
    _, errors = process.communicate(timeout=10 + COUNT / 2)
    assert (process.returncode, errors) == (0, ""), errors[-1000:]


def results(out: Path) -> dict[str, tuple[bytes, str]]:
    """Returns the samples of a batch: name of the picture -> its bytes, and what the manifest says was drawn."""
    lines = [json.loads(line) for line in (out / "manifest.jsonl").read_text().splitlines()]
    drawn = {Path(line["output"]).name: json.dumps(line.get("sample"), sort_keys=True) for line in lines if line.get("output")}
    return {path.name: (path.read_bytes(), drawn[path.name]) for path in sorted(out.glob("f.*.png"))}
