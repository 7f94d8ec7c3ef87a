"""The pytest plugin in the sample project: approval, faults, workers, CI, a run that is killed, and read-only baselines."""

from __future__ import annotations

import ctypes
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from support.command import run_command

from glshade.gl.renderer import Renderer
from glshade.golden.results import read
from glshade.scene.scene import Scene

pytest_plugins = ["pytester"]
SAMPLE = Path(__file__).parent / "sample"
PICTURES = "a_scene_file or a_scene or returned or Layers"
NAMES = [
    "balls/red.png",
    "test_sample_pictures/TestLayers.test_floats.exr",
    "test_sample_pictures/test_a_returned_picture-40.png",
    "test_sample_pictures/test_a_returned_picture-80.png",
    "test_sample_pictures/test_a_scene_file.png",
]


@pytest.fixture
def sample(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> pytest.Pytester:
    """A pytester whose folder holds the sample project."""
    monkeypatch.delenv("CI", raising=False)
    shutil.copytree(SAMPLE, pytester.path, dirs_exist_ok=True)
    return pytester


def files(folder: Path) -> dict[str, bytes]:
    """Returns the path and the bytes of every file in a folder."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def dimmed(scene: Scene) -> Scene:
    """Returns a scene in which the light `key` has half of its strength."""
    lights = [light.model_copy(update={"intensity": 0.4}) if light.name == "key" else light for light in scene.lights or ()]
    return scene.model_copy(update={"lights": lights})


def obey_permissions() -> None:
    """Takes from the superuser the right to write where the permissions forbid it. For other users, it does nothing."""
    # The numbers are Linux's PR_CAPBSET_DROP and CAP_DAC_OVERRIDE. The right is gone once the process starts a program.
    ctypes.CDLL(None).prctl(24, 1)


def commands(text: str) -> list[list[str]]:
    """Returns the arguments of the approve commands in the output of pytest."""
    return [shlex.split(line)[1:] for line in re.findall(r"(?m)\bglshade approve .*$", text)]


def test_approved_pictures_pass_and_a_fault_fails(
    sample: pytest.Pytester, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    first = sample.runpytest_inprocess("-k", PICTURES)
    first.assert_outcomes(failed=5)
    assert not (sample.path / "baselines").exists()
    assert sorted(case.name for case in read(sample.path / "glshade-results")) == NAMES
    copied = commands(first.stdout.str())
    assert len(copied) == 5
    for arguments in copied:
        assert run_command(capsys, *arguments).code == 0
    assert {path for path in files(sample.path / "baselines") if path.endswith((".png", ".exr"))} == set(NAMES)

    sample.runpytest_inprocess("--glshade-stability=2").assert_outcomes(passed=7)
    draw = Renderer.render
    monkeypatch.setattr(Renderer, "render", lambda self, scene, **options: draw(self, dimmed(scene), **options))
    faulty = sample.runpytest_inprocess("-k", "a_scene")
    faulty.assert_outcomes(failed=2)
    faulty.stdout.fnmatch_lines(["regression: light key x 0.50*", "*glshade approve * --only balls/red.png"])


def test_the_copied_command_works_in_another_folder(
    sample: pytest.Pytester, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    arguments = ("--rootdir=..", "-c", "../pytest.ini", "-k", "returned", "../test_sample_pictures.py")
    monkeypatch.chdir(sample.mkdir("a folder"))
    for command in commands(sample.runpytest_inprocess(*arguments).stdout.str()):
        assert run_command(capsys, *command).code == 0
    sample.runpytest_inprocess(*arguments).assert_outcomes(passed=2)


@pytest.mark.slow
def test_workers_give_the_same_bytes(sample: pytest.Pytester) -> None:
    summary = "--glshade-summary=html,json,junit"
    alone = sample.runpytest_subprocess(summary)
    alone.assert_outcomes(passed=2, failed=5)
    results = files(sample.path / "glshade-results")
    assert {"index.html", "results.json", "junit.xml"} <= results.keys()
    shutil.rmtree(sample.path / "glshade-results")
    spread = sample.runpytest_subprocess(summary, "-n", "2")
    spread.assert_outcomes(passed=2, failed=5)
    assert files(sample.path / "glshade-results") == results
    line = next(line for line in alone.outlines if line.startswith("glshade:"))
    assert line in spread.outlines


@pytest.mark.slow
def test_workers_see_two_tests_with_one_baseline_and_unused_ones(sample: pytest.Pytester) -> None:
    """The two tests run in different processes, and none of these knows which baselines the others use."""
    (sample.path / "test_sample_pictures.py").unlink()
    text = "import numpy\ndef test(render_regression): render_regression.check(numpy.zeros((4, 4)), name='{name}')\n"
    arguments = ("-n", "2", "--dist", "loadfile", "--glshade-disallow-unused", "--glshade-update=missing")
    for name in ("one", "two"):
        (sample.path / f"test_{name}.py").write_text(text.format(name="both"))
    both = sample.runpytest_subprocess(*arguments)
    both.assert_outcomes(passed=1, failed=1)
    both.stdout.re_match_lines([r"two tests use the baseline both.exr: test_(one|two).py::test and test_(one|two).py::test;"])
    for name in ("one", "two"):
        (sample.path / f"test_{name}.py").write_text(text.format(name=name))
    unused = sample.runpytest_subprocess(*arguments)
    unused.assert_outcomes(passed=2)
    assert unused.ret == pytest.ExitCode.TESTS_FAILED
    unused.stdout.fnmatch_lines(["glshade: no test uses these baselines in *; delete them: both.exr"])


def test_ci_refuses_updates(sample: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CI", "true")
    refused = sample.runpytest_inprocess("--glshade-update", "missing", "-k", "returned")
    assert refused.ret == pytest.ExitCode.USAGE_ERROR
    refused.stderr.fnmatch_lines(["ERROR: --glshade-update missing is refused because*--glshade-force*"])
    assert not (sample.path / "baselines").exists()

    forced = sample.runpytest_inprocess("--glshade-update", "missing", "--glshade-force", "-k", "returned")
    forced.assert_outcomes(passed=2)
    assert (sample.path / "baselines" / NAMES[2]).exists()


def test_a_configuration_file_cannot_update_in_ci(sample: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CI", "1")
    with (sample.path / "pytest.ini").open("a") as file:
        file.write("glshade_update = all\n")
    result = sample.runpytest_inprocess("-k", "returned")
    result.assert_outcomes(failed=2)
    result.stdout.fnmatch_lines(["glshade: no baseline was updated, because the environment variable CI is set*"])
    assert not (sample.path / "baselines").exists()


@pytest.mark.slow
def test_a_killed_run_keeps_the_results_so_far(sample: pytest.Pytester) -> None:
    sample.makepyfile(
        test_killed="""
        import os, signal
        import numpy as np

        def test_first(render_regression):
            render_regression.check(np.zeros((4, 4, 3), dtype=np.uint8))

        def test_second():
            os.kill(os.getpid(), signal.SIGKILL)
        """
    )
    killed = sample.runpytest_subprocess("test_killed.py")
    assert killed.ret == -signal.SIGKILL
    (case,) = read(sample.path / "glshade-results")
    assert (case.id, case.missing) == ("test_killed.py::test_first", True)
    assert (sample.path / "glshade-results" / str(case.actual)).is_file()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="the superuser's rights are taken away as Linux does it")
def test_read_only_baselines(sample: pytest.Pytester) -> None:
    """They are no obstacle, unless one has to be updated."""
    sample.makepyfile(
        test_read_only="""
        import os
        import numpy as np
        import pytest

        @pytest.mark.glshade_compare
        @pytest.mark.parametrize("change", [0, int(os.environ.get("SAMPLE_CHANGE", "0"))], ids=["steady", "changed"])
        def test_picture(change):
            return np.full((4, 4, 3), 100 + change, dtype=np.uint8)
        """
    )
    sample.runpytest_inprocess("test_read_only.py", "--glshade-update=missing").assert_outcomes(passed=2)
    baselines = sample.path / "baselines"
    before = files(baselines)
    folders = [baselines, *(path for path in baselines.rglob("*") if path.is_dir())]
    for folder in folders:
        folder.chmod(0o555)
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "test_read_only.py", "--glshade-update=failed"],
        capture_output=True,
        text=True,
        cwd=sample.path,
        env={**os.environ, "SAMPLE_CHANGE": "50"},
        preexec_fn=obey_permissions,
        check=False,
    )
    for folder in folders:
        folder.chmod(0o755)
    assert files(baselines) == before
    assert done.returncode == pytest.ExitCode.TESTS_FAILED, done.stdout + done.stderr
    assert "1 failed, 1 passed" in done.stdout
    assert re.search(r"(?m)^--glshade-update failed: .*cannot be written: Permission denied.*$", done.stdout)
