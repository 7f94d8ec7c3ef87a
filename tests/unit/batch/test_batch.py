"""Batches of pictures: which are made, skipped or failed, and what the command reports."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glshade.batch import jobs, leftovers
from glshade.batch.digest import digest_of, picture_digest
from glshade.batch.maker import Drawn, Maker
from glshade.batch.record import Record
from glshade.batch.task import Task
from glshade.errors import ContextError
from glshade.image import file as picture_file
from glshade.scene.file import load

# The exposure equals the frame number, so that a fake driver can tell which frame it draws.
SCENE = """
objects = [ { name = "ball", shape = "sphere", material = { brdf = "phong", exponent = 20 } } ]
animation = [ { key = "film.exposure", frames = [0, 60], values = [0, 60] } ]
lights = [ { type = "directional", direction = [-1, -1, -1], intensity = 0.01 } ]
[film]
size = [32, 24]
"""
# A sitecustomize.py, which every Python runs that has its folder on the path. It stands for a driver that crashes at frame 3.
CRASH = """
import os, pathlib
try:
    from glshade.gl.renderer import Renderer
except ImportError:
    pass
else:
    draw = Renderer.render
    def render(self, scene, **options):
        if scene.film.exposure == 3 and not (pathlib.Path({once!r}).exists() if {once!r} else False):
            if {once!r}:
                pathlib.Path({once!r}).touch()
            os.abort()
        return draw(self, scene, **options)
    Renderer.render = render
"""
NO_DRIVER = {"__EGL_VENDOR_LIBRARY_FILENAMES": "/nonexistent"}
PATIENCE = 60


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "s.toml").write_text(SCENE)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def run(folder: Path, glshade: Any) -> Any:
    """A function `run(*arguments)` that runs `glshade render s.toml` in the folder, as a process."""

    def run(*arguments: object, **environment: str) -> subprocess.CompletedProcess[str]:
        done: subprocess.CompletedProcess[str] = glshade("render", "s.toml", *arguments, cwd=folder, **environment)
        assert "Traceback" not in done.stderr
        return done

    return run


@pytest.fixture
def maker(renderer: Any) -> Maker:
    """A Maker on the context of the tests, which it must not close."""
    maker = Maker()
    maker._renderer = renderer
    return maker


def events(done: subprocess.CompletedProcess[str]) -> list[dict[str, Any]]:
    return [json.loads(line) for line in done.stdout.splitlines()]


def crash(folder: Path, once: str = "") -> dict[str, str]:
    """Returns environment variables with which frame 3 ends its process by SIGABRT.

    once: name of a marker file; with it, only the first attempt crashes
    """
    hook = folder / "hook"
    hook.mkdir()
    (hook / "sitecustomize.py").write_text(CRASH.format(once=once and str(folder / once)))
    return {"PYTHONPATH": str(hook)}


class TestCrash:
    """A worker crashes in the driver."""

    def test_a_picture_that_kills_its_worker_takes_no_other_with_it(self, run: Any, folder: Path) -> None:
        done = run("-f", "1-6", "-o", "out/f.#.png", "--jobs", "2", "--retries", "1", **crash(folder))
        assert done.returncode == 1
        assert sorted(done.stdout.split()) == [f"out/f.{frame}.png" for frame in (1, 2, 4, 5, 6)]
        lines = done.stderr.splitlines()
        assert "glshade: out/f.3.png: the driver ended the process that drew it, 2 times (SIGABRT)" in lines
        assert "glshade: 1 of 6 pictures failed: out/f.3.png" in lines
        manifest = [json.loads(line) for line in Path("out/manifest.jsonl").read_text().splitlines()]
        (failed,) = (line for line in manifest if line["state"] == "failed")
        assert (failed["output"], failed["attempts"], failed["exit_code"]) == ("f.3.png", 2, 1)
        assert not [name for name in os.listdir("out") if name.startswith(".")]
        again = run("-f", "1-6", "-o", "out/f.#.png", "--resume")
        assert (again.returncode, again.stdout) == (0, "out/f.3.png\n")

    def test_a_picture_that_succeeds_at_the_second_attempt_is_done(self, run: Any, folder: Path) -> None:
        done = run("-f", "1-4", "-o", "f.#.png", "--json", **crash(folder, once="crashed"))
        assert done.returncode == 0
        attempts = {event["output"]: event["attempts"] for event in events(done) if event["event"] == "done"}
        assert set(attempts) == {f"f.{frame}.png" for frame in range(1, 5)}
        assert attempts["f.3.png"] == 2

    def test_a_driver_that_crashes_every_worker_fails_the_batch(self, run: Any, folder: Path) -> None:
        (folder / "hook").mkdir()
        (folder / "hook" / "sitecustomize.py").write_text(
            "import os, sys\nif 'glshade.batch.worker' in sys.orig_argv: os.abort()"
        )
        done = run("-f", "1-4", "-o", "f.#.png", PYTHONPATH=str(folder / "hook"))
        assert done.returncode == 5
        assert done.stderr == "glshade: the driver ends the process that opens it (SIGABRT)\n"
        assert not list(folder.glob("f.*"))


class TestResume:
    """--resume skips a picture if its files hold exactly this picture."""

    @pytest.mark.parametrize("suffix", ["png", "jpg", "exr", "hdr", "tif"])
    def test_a_damaged_picture_is_made_again(self, suffix: str, run: Any, folder: Path) -> None:
        render = ("-f", "1-4", "-o", f"f.#.{suffix}", "--jobs", "1", "--resume")
        run(*render)
        good = [Path(f"f.{frame}.{suffix}").read_bytes() for frame in range(1, 5)]
        middle = len(good[1]) // 2
        flipped = good[1][:middle] + bytes([good[1][middle] ^ 1]) + good[1][middle + 1 :]
        for frame, damaged in ((1, good[0][:middle]), (2, flipped), (3, good[2][:-12])):
            Path(f"f.{frame}.{suffix}").write_bytes(damaged)
        assert sorted(run(*render).stdout.split()) == [f"f.{frame}.{suffix}" for frame in (1, 2, 3)]
        assert [Path(f"f.{frame}.{suffix}").read_bytes() for frame in range(1, 5)] == good

    def test_without_the_manifest_pictures_are_compared_with_new_ones(self, run: Any, folder: Path) -> None:
        render = ("-f", "1-2", "-o", "f.#.png", "--jobs", "1", "--resume")
        run(*render)
        Path("manifest.jsonl").unlink()
        good, before = Path("f.1.png").read_bytes(), Path("f.2.png").stat().st_mtime_ns
        Path("f.1.png").write_bytes(good[:-20])
        assert run(*render).stdout == "f.1.png\n"
        assert Path("f.1.png").read_bytes() == good
        assert Path("f.2.png").stat().st_mtime_ns == before
        assert len(Path("manifest.jsonl").read_text().splitlines()) == 2

    def test_a_damaged_layers_file_is_made_again(self, run: Any, folder: Path) -> None:
        render = ("-f", "1-2", "-o", "f.#.png", "--jobs", "1", "--aov", "depth", "--resume")
        run(*render)
        layers = Path("f.1.aovs.exr")
        good = layers.read_bytes()
        layers.write_bytes(good[:-20])
        assert run(*render).stdout == "f.1.png\n"
        assert layers.read_bytes() == good
        assert run(*render).stdout == ""

    def test_only_missing_and_different_pictures_are_made(self, run: Any, folder: Path) -> None:
        render = ("-f", "1-4", "-o", "f.#.png", "--resume")
        assert len(run(*render).stdout.split()) == 4
        before = {path: path.stat().st_mtime_ns for path in folder.glob("f.*.png")}
        assert run(*render).stdout == ""
        assert {path: path.stat().st_mtime_ns for path in folder.glob("f.*.png")} == before
        (folder / "f.2.png").write_bytes((folder / "f.3.png").read_bytes())
        (folder / "f.4.png").unlink()
        assert sorted(run(*render).stdout.split()) == ["f.2.png", "f.4.png"]
        assert len(run(*render, "--set", "objects.ball.material.exponent=21").stdout.split()) == 4
        lines = Path("manifest.jsonl").read_text().splitlines()
        assert len(lines) == 4 + 2 + 4

    def test_resume_of_a_single_picture(self, run: Any) -> None:
        assert run("-o", "x.png", "--resume").stdout == "x.png\n"
        assert run("-o", "x.png", "--resume").stdout == ""
        assert run("-o", "x.png").stdout == "x.png\n"
        assert run("-o", "x.png", "--resume", "--shading", "flat").stdout == "x.png\n"
        assert not Path("manifest.jsonl").exists()

    def test_a_picture_without_its_layers_file_is_made_again(self, maker: Maker, folder: Path) -> None:
        task = Task(0, "s.toml", "x.png", film={"aovs": ["depth"]}, resume=True)
        assert maker.make(task).state == "done"
        assert maker.make(task).state == "skipped"
        Path("x.aovs.exr").unlink()
        assert maker.make(task).state == "done"
        assert maker.make(replace(task, output="y.exr")).state == "done"
        assert maker.make(replace(task, output="y.exr")).state == "skipped"
        assert not Path("y.aovs.exr").exists()

    @pytest.mark.parametrize("suffix", sorted(picture_file.SUFFIXES - {".hdr"}))
    def test_every_format_stores_the_digest(self, suffix: str, maker: Maker, folder: Path) -> None:
        record = maker.make(Task(0, "s.toml", f"x{suffix}"))
        assert len(record.digest) == 64
        assert digest_of(record.output) == record.digest

    def test_the_digest_depends_on_everything_that_changes_the_picture(self, folder: Path) -> None:
        (folder / "tri.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        (folder / "m.toml").write_text('objects = [ { mesh = "tri.obj" } ]')
        scene, task = load("m.toml"), Task(0, "m.toml", "x.png")
        first = picture_digest(scene, task, "driver", "code")
        for same in (
            replace(task, number=7),
            replace(task, output="a/y.png"),
            replace(task, resume=True),
        ):
            assert picture_digest(scene, same, "driver", "code") == first
        others = {
            picture_digest(scene, task, "another", "code"),
            picture_digest(scene, task, "driver", "another"),
            picture_digest(scene, replace(task, output="x.exr"), "driver", "code"),
            picture_digest(scene, replace(task, shading="flat"), "driver", "code"),
            picture_digest(scene, replace(task, tile=64), "driver", "code"),
            picture_digest(scene, replace(task, reference=True), "driver", "code"),
            picture_digest(load("m.toml", {"film.exposure": 1}), task, "driver", "code"),
        }
        (folder / "tri.obj").write_text("v 0 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\n")
        others.add(picture_digest(load("m.toml"), task, "driver", "code"))
        assert len(others | {first}) == 9

    def test_the_digest_of_a_view_depends_on_its_configuration(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        task = Task(0, "s.toml", "x.png")
        plain, transformed = load("s.toml"), load("s.toml", {"film.view": "Raw"})
        monkeypatch.delenv("OCIO", raising=False)
        before = picture_digest(plain, task, "driver", "code"), picture_digest(transformed, task, "driver", "code")
        (folder / "c.ocio").write_text("one")
        monkeypatch.setenv("OCIO", str(folder / "c.ocio"))
        first = picture_digest(transformed, task, "driver", "code")
        (folder / "c.ocio").write_text("two")
        assert len({*before, first, picture_digest(transformed, task, "driver", "code")}) == 4
        assert picture_digest(plain, task, "driver", "code") == before[0]

    def test_only_leftovers_of_ended_processes_are_removed(self, folder: Path) -> None:
        gone = subprocess.Popen([sys.executable, "-c", ""])
        gone.wait()
        ours = [f".x.{gone.pid}.png", f".x.aovs.{gone.pid}.exr"]
        others = [f".x.{os.getpid()}.png", f".y.{gone.pid}.png", ".x.png", ".x.7a.png", "x.1.png"]
        for name in (*ours, *others):
            (folder / name).touch()
        leftovers.remove([folder / "x.png"])
        assert sorted(path.name for path in folder.iterdir() if path.name != "s.toml") == sorted(others)


class TestFaults:
    """A failure is reported once and leaves no incomplete file."""

    def test_a_full_disk_stops_the_batch(self, folder: Path) -> None:
        command = f"ulimit -f 4; {sys.executable} -m glshade render s.toml -f 1-40 -o out/f.##.png --size 256x256 --jobs 2"
        environment = {**os.environ, "GLSHADE_PROGRAM_CACHE": "0", "MESA_SHADER_CACHE_DISABLE": "true"}
        done = subprocess.run(
            ["bash", "-c", command], cwd=folder, capture_output=True, text=True, timeout=PATIENCE, env=environment, check=False
        )
        assert (done.returncode, done.stdout) == (1, "")
        lines = done.stderr.splitlines()
        assert lines[0].startswith("glshade: out/f.")
        assert lines[0].endswith("cannot be written: File too large")
        assert "pictures were not begun: continue with --resume" in done.stderr
        assert len(lines) < 12
        assert os.listdir("out") == ["manifest.jsonl"]

    def test_a_folder_that_cannot_be_created(self, run: Any, folder: Path) -> None:
        (folder / "out").touch()
        done = run("-f", "1-4", "-o", "out/f.#.png")
        assert (done.returncode, done.stderr) == (1, "glshade: out: cannot be made: File exists\n")

    def test_a_folder_in_the_place_of_a_picture_fails_only_that_picture(self, run: Any, folder: Path) -> None:
        (folder / "f.2.png").mkdir()
        done = run("-f", "1-4", "-o", "f.#.png", "--overwrite")
        assert done.returncode == 1
        assert sorted(done.stdout.split()) == ["f.1.png", "f.3.png", "f.4.png"]
        assert "f.2.png: cannot be written: Is a directory" in done.stderr

    def test_an_asset_that_vanishes(self, maker: Maker, folder: Path) -> None:
        (folder / "tri.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        (folder / "m.toml").write_text('objects = [ { mesh = "tri.obj" } ]\nfilm = { size = [8, 8] }')
        task = Task(0, "m.toml", "x.png")
        assert maker.make(task).state == "done"
        (folder / "tri.obj").unlink()
        record = maker.make(replace(task, output="y.png"))
        assert (record.state, record.exit_code) == ("failed", 3)
        assert record.error.startswith("m.toml: objects[0].mesh: ")
        assert record.error.endswith("tri.obj: no such file")
        assert not Path("y.png").exists()

    def test_without_a_driver(self, run: Any, folder: Path) -> None:
        done = run("-f", "1-4", "-o", "f.#.png", "--backend", "egl", **NO_DRIVER)
        assert done.returncode == 5
        assert done.stderr.count("\n") == 1
        # The reference needs no driver.
        done = run("-f", "1-4", "-o", "f.#.png", "--reference", "--size", "8x6", **NO_DRIVER)
        assert (done.returncode, len(done.stdout.split())) == (0, 4)

    def test_a_faulty_scene_is_reported_before_any_file_is_written(self, run: Any, folder: Path) -> None:
        done = run("-f", "1-4", "-o", "f.#.png", "--set", "objects.ball.material.exponent=-1")
        assert done.returncode == 3
        assert done.stderr.count("\n") == 1
        done = run("-f", "1-9", "-o", "f.#.png", "--size", "200000x3")
        assert done.returncode == 2
        assert "'--size'" in done.stderr
        assert sorted(os.listdir()) == ["s.toml"]

    def test_a_scene_that_is_faulty_from_some_frame_on(self, run: Any, folder: Path) -> None:
        done = run("-f", "62-70", "-o", "f.#.png", "--set", "animation.0.values=[0,100]", "--set", "animation.0.frames=[0,100]")
        assert done.returncode == 1
        assert sorted(done.stdout.split()) == ["f.62.png", "f.63.png", "f.64.png"]
        assert "film.exposure: must be less than or equal to 64, not 65" in done.stderr

    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            (("--resume", "--overwrite"), "exclude each other"),
            (("--jobs", "0"), "'--jobs'"),
            (("--sweep", "a"), "'--sweep': 'a' is not KEY=VALUE"),
            (("--crop", "1,2"), "'1,2' is not a window such as 10,20,64x48"),
            (("--crop", "0,0,64x1"), "'--crop': reaches to 64, 1, beyond the picture, which is 32 x 24"),
            (("--aov", "depht"), "'--aov': unknown layer 'depht'; did you mean \"depth\"?"),
            (("--supersample", "99"), "'--supersample': must be"),
            (("--cluster", "nowhere"), "'--cluster': 'nowhere' is neither"),
        ],
    )
    def test_usage(self, arguments: tuple[str, ...], message: str, folder: Path) -> None:
        from click.testing import CliRunner

        from glshade.cli import cli

        result = CliRunner().invoke(cli, ["render", "s.toml", *arguments])
        assert result.exit_code == 2
        assert message in result.output
        assert sorted(os.listdir()) == ["s.toml"]


class TestCommand:
    """The files and the output of the command."""

    def test_events(self, run: Any) -> None:
        done = run("-f", "0-3", "-o", "f.#.png", "--json", "--jobs", "1")
        first, *records, last = events(done)
        assert first | {"driver": ""} == {"event": "begin", "pictures": 4, "jobs": 1, "driver": ""}
        assert first["driver"]
        assert {(record["event"], record["frame"], record["output"]) for record in records} == {
            ("done", frame, f"f.{frame}.png") for frame in range(4)
        }
        assert {name: last[name] for name in ("event", "done", "skipped", "failed", "left")} == {
            "event": "end",
            "done": 4,
            "skipped": 0,
            "failed": 0,
            "left": 0,
        }
        assert 0 < last["seconds_pictures"] < last["seconds"]
        assert done.stderr == ""
        first, *records, last = events(run("-f", "0-4", "-o", "f.#.png", "--json", "--skip-existing"))
        assert sorted(record["event"] for record in records) == ["done", *["skipped"] * 4]
        assert (last["done"], last["skipped"]) == (1, 4)

    def test_a_sweep_equals_set_with_each_value(self, run: Any) -> None:
        done = run(
            "--sweep", "objects.ball.material.exponent=5,500", "--sweep", "film.size=[8,6],[4,3]", "-o", "{exponent}/{size}.png"
        )
        assert sorted(done.stdout.split()) == ["5/4_3.png", "5/8_6.png", "500/4_3.png", "500/8_6.png"]
        run("-o", "x.png", "--set", "objects.ball.material.exponent=500", "--set", "film.size=[8,6]")
        assert Path("500/8_6.png").read_bytes() == Path("x.png").read_bytes()
        assert Path("5/8_6.png").read_bytes() != Path("x.png").read_bytes()

    def test_the_bytes_do_not_depend_on_the_number_of_workers(self, run: Any) -> None:
        for jobs_ in (1, 2):
            run("-f", "1-5", "-o", f"{jobs_}/f.#.png", "--jobs", jobs_)
        run("-f", "4", "-o", "x.png")
        for frame in range(1, 6):
            assert Path(f"1/f.{frame}.png").read_bytes() == Path(f"2/f.{frame}.png").read_bytes()
        assert Path("x.png").read_bytes() == Path("1/f.4.png").read_bytes()

    def test_the_film_and_its_layers(self, run: Any) -> None:
        assert (
            run("-o", "x.exr", "--crop", "8,6,16x12", "--supersample", "2", "--aov", "depth,normal", "--aov", "uv").returncode
            == 0
        )
        assert run("-o", "y.exr", "--supersample", "2").returncode == 0
        crop, whole = (picture_file.read(name)[0] for name in ("x.exr", "y.exr"))
        assert np.array_equal(crop[..., :3], whole[6:18, 8:24, :3])
        import OpenImageIO as oiio

        source = oiio.ImageInput.open("x.exr")
        assert {"R", "depth.Z", "normal.X", "uv.U"} <= set(source.spec().channelnames)
        source.close()

    def test_ctrl_c_finishes_the_pictures_that_are_begun(self, run: Any, folder: Path) -> None:
        command = [sys.executable, "-m", "glshade", "render", "s.toml", "-f", "1-3000", "-o", "out/f.#.png", "--jobs", "2"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            assert process.stderr is not None
            printed = [process.stdout.readline()]
            process.send_signal(signal.SIGINT)
            printed += process.stdout
            error = process.stderr.read()
            assert process.wait(PATIENCE) == 130, error
        assert error.splitlines()[-1] == "glshade: interrupted"
        written = [name for name in os.listdir("out") if name != "manifest.jsonl"]
        assert len(written) == len(printed) < 2000
        assert all(name.startswith("f.") for name in written)
        assert len(Path("out/manifest.jsonl").read_text().splitlines()) == len(written)

    def test_workers_start_before_slow_modules_are_imported(self, python: Any, folder: Path) -> None:
        code = (
            "import sys; from glshade.batch import pool; from glshade.cli import run\n"
            "start = pool.Process.__init__\n"
            "def seen(*given, **named):\n"
            "    print(sorted({'numpy', 'pydantic', 'moderngl', 'OpenImageIO'} & set(sys.modules)))\n"
            "    start(*given, **named)\n"
            "pool.Process.__init__ = seen\n"
            "sys.argv = 'glshade render s.toml -f 1-2 -o f.#.png --jobs 1'.split()\n"
            "run()"
        )
        assert python(code, cwd=folder).splitlines()[0] == "[]"

    def test_a_warning_is_printed_once(self, run: Any, folder: Path) -> None:
        (folder / "s.toml").write_text(SCENE.replace('"phong"', '"phong", alpha_mode = "blend", alpha = 0.5'))
        done = run("-f", "1-8", "-o", "f.#.png", "--jobs", "2")
        assert done.returncode == 0
        assert done.stderr.count("warning: blended surfaces") == 1
        assert done.stderr.count("\n") == 1


def test_one_thread_draws_while_others_write(maker: Maker, folder: Path) -> None:
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(2) as writers:
        written = []
        for frame in range(6):
            drawn = maker.draw(Task(frame, "s.toml", f"t.{frame}.png", frame=frame))
            assert isinstance(drawn, Drawn)
            written.append(writers.submit(drawn.write))
    assert [record.result().state for record in written] == ["done"] * 6
    for frame in range(6):
        alone = maker.make(Task(frame, "s.toml", f"a.{frame}.png", frame=frame))
        assert isinstance(alone, Record)
        assert Path(f"a.{frame}.png").read_bytes() == Path(f"t.{frame}.png").read_bytes()


def test_jobs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jobs, "cores", lambda: 4)
    assert jobs.devices(None, 100, []) == [None] * 4
    assert jobs.devices(None, 2, []) == [None]
    assert jobs.devices(3, 2, []) == [None] * 3
    assert jobs.devices(None, 100, [0, 2]) == [0, 2]
    assert jobs.devices(None, 1, [0, 2]) == [0]
    assert jobs.devices(5, 100, [0, 2]) == [0, 2, 0, 2, 0]
    assert jobs.devices(None, 100, [1]) == [1]


def test_ctrl_c_while_a_task_is_handed_out(folder: Path) -> None:
    from glshade.batch.pool import Pool

    with Pool([None]) as pool:
        pool.ready()
        worker = pool._workers[0].process
        # A stopped worker does not read. A task larger than the pipe's buffer (64 KiB) then blocks in the middle of being sent.
        worker.send_signal(signal.SIGSTOP)
        interrupt = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
        go_on = threading.Timer(0.6, worker.send_signal, (signal.SIGCONT,))
        interrupt.start()
        go_on.start()
        with pytest.raises(KeyboardInterrupt):
            list(pool.records([Task(0, "s.toml", "a.png", (("name", "n" * 200_000),))]))
        go_on.join()


def test_a_device_that_does_not_exist(folder: Path) -> None:
    from glshade.batch.pool import Pool

    with Pool([99, 99]) as pool, pytest.raises(ContextError, match="there is no EGL device 99"):
        pool.ready()


@pytest.mark.parametrize("options", ["", "--json"])
def test_all_pictures_are_made_after_the_reader_of_stdout_has_gone(folder: Path, options: str) -> None:
    command = f"{sys.executable} -m glshade render s.toml -f 1-6 {options} -o 'out/#.png' | head -n 1; echo ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", command], cwd=folder, capture_output=True, text=True, timeout=60, check=True)
    assert (done.stdout.splitlines()[1:], done.stderr) == (["0"], "")
    assert {path.name for path in (folder / "out").glob("*.png")} == {f"{n}.png" for n in range(1, 7)}


def test_a_temporary_file_whose_process_ends_during_the_batch_is_removed(folder: Path) -> None:
    """The worker of a command that was killed earlier is alive when the batch begins, and has ended when it ends."""
    orphan = subprocess.Popen(["sleep", "60"])
    temporary = folder / f".4.{orphan.pid}.png"
    temporary.touch()
    command = [sys.executable, "-m", "glshade", "render", "s.toml", "-f", "1-12", "-o", "#.png", "--jobs", "1"]
    with subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE) as batch:
        assert batch.stdout is not None
        batch.stdout.readline()
        assert temporary.exists(), "its process is alive"
        orphan.kill()
        orphan.wait()
        batch.stdout.read()
    assert batch.returncode == 0
    assert not temporary.exists()


@pytest.mark.slow
def test_memory_stays_flat(maker: Maker, folder: Path) -> None:
    """A worker takes no more memory after 10,000 pictures than after 1,000."""

    def resident() -> int:
        text = Path("/proc/self/statm").read_text()
        return int(text.split()[1]) * os.sysconf("SC_PAGE_SIZE")

    def make(first: int, last: int) -> None:
        for number in range(first, last):
            record = maker.make(Task(number, "s.toml", "x.png", frame=number, film={"size": (16, 12)}))
            assert record.state == "done"

    (folder / "s.toml").write_text(SCENE.replace("[0, 60]", "[0, 20000]", 1))
    make(0, 1000)
    early = resident()
    make(1000, 10_000)
    late = resident()
    assert late - early < 5e6, f"{early / 1e6:.1f} MB after 1,000 pictures, {late / 1e6:.1f} MB after 10,000"
