"""A batch on dask.distributed makes the same pictures as a pool, even if processes die."""

from __future__ import annotations

import http.client
import json
import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from glshade.batch import cluster, parcel
from glshade.batch.digest import code_digest
from glshade.batch.task import Task
from glshade.errors import ContextError, GlshadeError

pytest.importorskip("distributed")

import psutil  # a dependency of distributed

SCENE = """
film = { size = [192, 192], samples = 4 }
camera = { eye = [0, 1, 4], target = [0, 0, 0] }
materials.red = { brdf = "blinn_phong", kd = [0.6, 0.06, 0.05], ks = 0.5, exponent = 80 }
objects = [{ shape = { type = "sphere", segments = 96, rings = 48 }, material = "red" }, { shape = "cube", material = "red" }]
lights = [{ type = "directional", direction = [0.6, -1, -0.7] }]
animation = [{ key = "camera.turn", frames = [1, 30], values = [0, 90] }]
"""
FRAMES = 30


class Batch:
    """A command that runs as a process group of its own, and its files."""

    def __init__(self, scene: Path, folder: Path, *options: str, **environment: str) -> None:
        self.folder = folder
        command = [sys.executable, "-m", "glshade", "render", str(scene), "-f", f"1-{FRAMES}", "-o", str(folder / "####.png")]
        self.process = subprocess.Popen(
            [*command, *options],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            env={**os.environ, **environment},
        )

    def pictures(self) -> dict[str, int]:
        """Returns the pictures that exist: name -> time of writing [ns]."""
        return {path.name: path.stat().st_mtime_ns for path in self.folder.glob("[0-9]*.png")}

    def wait_for(self, count: int) -> dict[str, int]:
        """Waits until `count` pictures exist or the command has ended, and returns the pictures."""
        while len(self.pictures()) < count and self.process.poll() is None:
            time.sleep(0.005)
        return self.pictures()

    def workers(self) -> list[psutil.Process]:
        """Returns the processes of a local cluster's workers."""
        return [child for child in self.children() if "spawn_main" in " ".join(child.cmdline())]

    def children(self) -> list[psutil.Process]:
        return psutil.Process(self.process.pid).children(recursive=True)

    def ended(self) -> tuple[int, str]:
        """Waits for the end of the command, and returns its exit code and stderr."""
        error = self.process.communicate(timeout=300)[1]
        return self.process.returncode, error

    def lines(self) -> Counter[str]:
        """Returns the number of lines of the manifest that report each output as done."""
        text = (self.folder / "manifest.jsonl").read_text()
        return Counter(line["output"] for line in map(json.loads, text.splitlines()) if line["state"] == "done")


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("scene") / "turn.toml"
    path.write_text(SCENE)
    return path


@pytest.fixture(scope="module")
def expected(scene: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The pictures that a pool makes: name -> bytes."""
    batch = Batch(scene, tmp_path_factory.mktemp("pool"), "--jobs", "2")
    code, error = batch.ended()
    assert code == 0, error
    pictures = contents(batch.folder)
    assert len(pictures) == FRAMES
    return pictures


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.glob("*.png")}


def temporary(folder: Path) -> list[str]:
    return [path.name for path in folder.iterdir() if path.name.startswith(".")]


def gone(processes: list[psutil.Process]) -> bool:
    return not psutil.wait_procs(processes, timeout=10)[1]


def check(batch: Batch, expected: dict[str, bytes], before: dict[str, int]) -> None:
    """Checks that all pictures have the pool's bytes and one line each, and that those in `before` were not written again."""
    assert contents(batch.folder) == expected
    assert batch.lines() == Counter(dict.fromkeys(expected, 1))
    assert temporary(batch.folder) == []
    after = batch.pictures()
    assert {name: after[name] for name in before} == before


LOCAL = ("--cluster", "local", "--jobs", "2")

# A sitecustomize.py, which every Python runs that has its folder on the path. In the workers, which dask starts by
# multiprocessing, it runs a statement before each picture is drawn.
BEFORE = """
import os, sys, time
if "spawn_main" in " ".join(sys.orig_argv):
    from glshade.batch.maker import Maker
    draw = Maker.draw
    def draw_after(self, task, *rest):
        STATEMENT
        return draw(self, task, *rest)
    Maker.draw = draw_after
"""
# Slows a batch down to seconds, so that a test can disturb it halfway even on a busy machine.
SLOWLY = "time.sleep(0.1)"


def workers_do(statement: str, folder: Path) -> dict[str, str]:
    """Returns environment variables with which workers run the statement, and writes the file for it to the folder."""
    (folder / "sitecustomize.py").write_text(BEFORE.replace("STATEMENT", statement))
    return {"PYTHONPATH": str(folder)}


def test_a_killed_worker_costs_no_picture(scene: Path, expected: dict[str, bytes], tmp_path: Path) -> None:
    batch = Batch(scene, tmp_path, *LOCAL)
    before = batch.wait_for(2)
    workers = batch.workers()
    assert len(workers) == 2
    workers[0].kill()
    code, error = batch.ended()
    assert (code, error) == (0, "")
    check(batch, expected, before)
    assert gone(workers)


@pytest.mark.slow
def test_a_killed_command_can_be_resumed(scene: Path, expected: dict[str, bytes], tmp_path: Path) -> None:
    out = tmp_path / "out"
    killed = Batch(scene, out, *LOCAL, **workers_do(SLOWLY, tmp_path))
    killed.wait_for(2)
    children = killed.children()
    killed.process.kill()
    assert killed.ended()[0] == -signal.SIGKILL
    assert gone(children)
    before = killed.pictures()
    assert 2 <= len(before) < FRAMES
    resumed = Batch(scene, out, *LOCAL, "--resume")
    code, error = resumed.ended()
    assert (code, error) == (0, "")
    check(resumed, expected, before)


@pytest.mark.slow
def test_an_interruption_leaves_nothing_behind(scene: Path, expected: dict[str, bytes], tmp_path: Path) -> None:
    batch = Batch(scene, tmp_path / "out", *LOCAL, **workers_do(SLOWLY, tmp_path))
    batch.wait_for(2)
    children = batch.children()
    # A terminal sends Ctrl-C to the whole process group.
    os.killpg(batch.process.pid, signal.SIGINT)
    code, error = batch.ended()
    assert code == 130, error
    assert "Traceback" not in error
    assert gone(children)
    assert temporary(batch.folder) == []
    # The pictures that were made are complete, and have their lines.
    pictures = contents(batch.folder)
    assert 2 <= len(pictures) < FRAMES
    assert pictures == {name: expected[name] for name in pictures}
    assert batch.lines() == Counter(dict.fromkeys(pictures, 1))


@pytest.mark.slow
def test_a_frame_that_kills_its_worker_fails_alone(scene: Path, expected: dict[str, bytes], tmp_path: Path) -> None:
    crash = workers_do("if task.frame == 7: os.kill(os.getpid(), 11)", tmp_path)
    batch = Batch(scene, tmp_path / "out", *LOCAL, "--retries", "1", **crash)
    code, error = batch.ended()
    assert code == 1
    assert "0007.png: the worker that drew it died, 2 times" in error
    assert contents(batch.folder) == {name: data for name, data in expected.items() if name != "0007.png"}
    failed = [line for line in (batch.folder / "manifest.jsonl").read_text().splitlines() if '"failed"' in line]
    assert len(failed) == 1
    assert "0007.png" in failed[0]


# Closes the connections of a worker in the middle of writing, half a second before it ends. The file stands for an incomplete
# picture.
LOST = """if task.frame == 7:
            from pathlib import Path
            from glshade.files import beside
            beside(Path(task.output), os.getpid()).touch()
            os.closerange(3, 1024)
            time.sleep(0.5)
            os.kill(os.getpid(), 9)"""


@pytest.mark.slow
def test_a_worker_that_ends_after_its_connection_leaves_no_incomplete_file(scene: Path, tmp_path: Path) -> None:
    batch = Batch(scene, tmp_path / "out", *LOCAL, "--retries", "0", **workers_do(LOST, tmp_path))
    code, error = batch.ended()
    assert code == 1, error
    assert temporary(batch.folder) == []
    assert len(contents(batch.folder)) == FRAMES - 1


class Dask:
    """A scheduler and a worker, started by the command line of dask."""

    def __init__(self, folder: Path, **environment: str) -> None:
        self.file = folder / "scheduler.json"
        quiet = {**os.environ, "DASK_LOGGING__DISTRIBUTED": "critical", **environment}
        self.processes = [
            self._start(quiet, "scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(self.file)),
            # Several threads, because dask's default is one for each core.
            self._start(quiet, "worker", "--scheduler-file", str(self.file), "--nworkers", "1", "--nthreads", "4"),
        ]

    @staticmethod
    def _start(environment: dict[str, str], kind: str, *options: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", f"distributed.cli.dask_{kind}", "--no-dashboard", *options]
        return subprocess.Popen(command, env=environment)

    @property
    def address(self) -> str:
        while not self.file.exists():
            time.sleep(0.02)
        return str(json.loads(self.file.read_text())["address"])

    def end(self) -> None:
        # The worker ends first, because it would wait long for a scheduler that has gone.
        for process in reversed(self.processes):
            process.terminate()
            process.wait(30)


@pytest.fixture(scope="module")
def dask(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Dask]:
    started = Dask(tmp_path_factory.mktemp("dask"))
    yield started
    started.end()


def test_a_scheduler_that_runs_already(dask: Dask, scene: Path, expected: dict[str, bytes], tmp_path: Path) -> None:
    batch = Batch(scene, tmp_path, "--cluster", dask.address)
    code, error = batch.ended()
    assert (code, error) == (0, "")
    check(batch, expected, {})


@pytest.mark.slow
def test_a_lost_scheduler_is_reported_and_the_batch_can_be_resumed(
    scene: Path, expected: dict[str, bytes], tmp_path: Path
) -> None:
    dask = Dask(tmp_path, **workers_do(SLOWLY, tmp_path))
    out = tmp_path / "out"
    batch = Batch(scene, out, "--cluster", dask.address)
    batch.wait_for(2)
    # Suspended workers make sure that the scheduler is lost before the last picture.
    workers = psutil.Process(dask.processes[1].pid).children(recursive=True)
    for worker in workers:
        worker.suspend()
    dask.processes[0].kill()
    code, error = batch.ended()
    for worker in workers:
        worker.resume()
    assert code == 1
    assert "is lost" in error
    assert "--resume" in error
    # The worker must finish its picture before the files are counted.
    dask.end()
    before = batch.pictures()
    assert 2 <= len(before) < FRAMES
    resumed = Batch(scene, out, "--jobs", "2", "--resume")
    assert resumed.ended()[0] == 0
    check(resumed, expected, before)


def test_a_local_cluster_shows_no_pages(scene: Path, tmp_path: Path) -> None:
    """Other users of the machine can connect to its ports."""
    batch = Batch(scene, tmp_path / "out", *LOCAL, **workers_do(SLOWLY, tmp_path))
    batch.wait_for(2)
    processes = [psutil.Process(batch.process.pid), *batch.children()]
    ports = [link.laddr.port for p in processes for link in p.net_connections("tcp") if link.status == psutil.CONN_LISTEN]
    answers = [status for port in ports for status in statuses(port)]
    batch.process.send_signal(signal.SIGINT)
    batch.ended()
    assert 404 in answers
    assert set(answers) <= {404, None}


def statuses(port: int) -> Iterator[int | None]:
    """Yields the HTTP status of each of dask's pages on this machine; None alone if the port is not one of an HTTP server."""
    for page in ("status", "info/main/workers.html", "json/counts.json", "metrics"):
        status = answer(port, page)
        yield status
        if status is None:
            break


def answer(port: int, page: str) -> int | None:
    """Returns the HTTP status of a page on this machine; None if the port is not one of an HTTP server."""
    # Other servers wait for more, so that the time runs out.
    link = http.client.HTTPConnection("127.0.0.1", port, timeout=5)
    try:
        link.request("GET", f"/{page}")
        return link.getresponse().status
    except (http.client.HTTPException, OSError):
        return None
    finally:
        link.close()


def test_no_scheduler_at_the_address(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "CONNECTING", 0.3)
    with pytest.raises(GlshadeError, match=r"no dask scheduler answers at tcp://127\.0\.0\.1:9: ") as caught:
        cluster.Cluster("tcp://127.0.0.1:9")
    assert caught.value.exit_code == 1


@pytest.mark.parametrize("address", ["lokal", "tcp://", "tcp://host", "http://host:8786", "host:8786"])
def test_invalid_addresses(address: str) -> None:
    with pytest.raises(ValueError, match="tcp://host:8786"):
        cluster.check_address(address)


def test_usage(glshade: Any, scene: Path) -> None:
    done = glshade("render", scene, "--cluster", "nowhere")
    assert done.returncode == 2
    assert "'nowhere' is neither local nor a scheduler's address" in done.stderr


@pytest.fixture
def conditions() -> Iterator[parcel.Conditions]:
    """Conditions for `make` in this process, whose contexts are released afterwards."""
    yield {
        "code": code_digest(),
        "backend": "auto",
        "device": None,
        "shaders": [],
        "models": [],
        "reference": False,
        "hardware": False,
    }
    parcel.forget()


def test_another_glshade_is_refused(conditions: parcel.Conditions) -> None:
    with pytest.raises(GlshadeError, match="has another glshade"):
        parcel.make([], {**conditions, "code": "0"})


def test_a_worker_without_glshade_says_so(python: Any, tmp_path: Path) -> None:
    # dask ends a worker that cannot unpickle a task. So unpickling must work without glshade, and only the call may fail.
    import cloudpickle

    (tmp_path / "sent").write_bytes(cloudpickle.dumps(cluster._sendable()))
    read = "import sys, pickle; sys.modules['glshade'] = None; sent = pickle.load(open('sent', 'rb'))\n"
    call = "try: sent([], {})\nexcept ImportError as error: print('glshade' in str(error))"
    assert python(read + call, cwd=tmp_path) == "True"


def test_a_worker_with_a_gpu_that_draws_on_the_cpu_is_refused(conditions: parcel.Conditions, renderer: Any) -> None:
    if "llvmpipe" not in renderer.context.renderer:
        pytest.skip("this machine has a GPU")
    with pytest.raises(ContextError, match="has a GPU, but the driver's own choice draws on the CPU"):
        parcel.make([], {**conditions, "hardware": True})


def test_the_environment_of_a_worker_selects_its_device(conditions: parcel.Conditions, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GLSHADE_DEVICE", "63")
    with pytest.raises(ContextError, match=r"the worker on .*63"):
        parcel.make([], {**conditions, "device": 0})


def test_a_picture_written_since_it_was_handed_out_is_not_written_again(
    conditions: parcel.Conditions, scene: Path, tmp_path: Path
) -> None:
    output = tmp_path / "1.png"
    task = Task(0, str(scene), str(output), frame=1).as_dict()
    first = parcel.make([(task, 0)], conditions)["records"][0]
    written = output.stat().st_mtime_ns
    # This happens if the worker dies before it reports the picture, and dask gives the task to another worker.
    again = parcel.make([(task, 0)], conditions)["records"][0]
    assert output.stat().st_mtime_ns == written
    assert again["state"] == "done"
    assert again["sha256"] == first["sha256"]
    # With --overwrite the file existed before the task was handed out, so it is written again.
    parcel.make([(task, written)], conditions)
    assert output.stat().st_mtime_ns > written


@pytest.mark.slow
@pytest.mark.parametrize("victim", ["driver", "worker"])
def test_fifty_kills(victim: str, scene: Path, expected: dict[str, bytes], tmp_path: Path) -> None:
    """After SIGKILL at random times, resumed batches have the same pictures, and none is written twice."""
    chance = random.Random(victim)
    kills = runs = 0
    while kills < 50:
        folder = tmp_path / str(runs)
        folder.mkdir()
        runs += 1
        before: dict[str, int] = {}
        options: tuple[str, ...] = LOCAL
        while True:
            batch = Batch(scene, folder, *options)
            # If few pictures are left, workers would be killed before they can draw any, again and again.
            if victim == "worker" and not before:
                kills += _kill_workers(batch, chance)
            elif victim == "driver" and len(before) < FRAMES:
                # Some kills fall before the first picture or after the last.
                batch.wait_for(len(before) + chance.randint(0, 8))
                time.sleep(chance.uniform(0, 0.05))
                batch.process.kill()
            ended = batch.ended()[0]
            kills += victim == "driver" and ended != 0
            after = batch.pictures()
            assert {name: after[name] for name in before} == before
            before = after
            options = (*LOCAL, "--resume")
            if ended == 0:
                break
        check(batch, expected, before)
    print(f"{kills} kills in {runs} batches")


def _kill_workers(batch: Batch, chance: random.Random) -> int:
    """Kills up to five workers at random times while the batch runs, and returns the number of kills."""
    kills = 0
    while batch.process.poll() is None and kills < 5:
        batch.wait_for(chance.randint(1, FRAMES - 1) if kills == 0 else 0)
        time.sleep(chance.uniform(0, 0.5))
        try:
            workers = batch.workers()
            if workers:
                chance.choice(workers).kill()
                kills += 1
        except psutil.Error:
            pass
    return kills
