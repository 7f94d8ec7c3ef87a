"""The options --shaders and --models: every command that draws or explains takes the user's own files."""

from __future__ import annotations

import importlib.util
import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from support.command import Result, run_command
from support.folders import CHALK_GLSL, SCENE, VALUE, forget_models, lambert, write, write_models

from glshade import BRDFS
from glshade.bench.brdfs import size
from glshade.image.file import read

# Each draws or explains its own: the plane is chalk, or Lambertian by the shader folder's file.
PLAIN = SCENE.replace('brdf = "chalk", tint', 'brdf = "lambert", kd').replace("zenith", "directional")
FOLDERS = ("--models", "models", "--shaders", "own")


Run = Callable[..., Result]


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """`run(*arguments)` as `glshade` would, in a folder with s.toml (chalk), plain.toml (Lambertian), models/ and own/.

    Each run starts without model folders, as a process of its own would.
    """
    (tmp_path / "s.toml").write_text(SCENE)
    (tmp_path / "plain.toml").write_text(PLAIN)
    write_models(tmp_path / "models")
    write(tmp_path, "own/brdf/lambert.glsl", lambert("0.25"))
    monkeypatch.chdir(tmp_path)

    def run(*arguments: object) -> Result:
        with pytest.MonkeyPatch.context() as patch:
            forget_models(patch)
            return run_command(capsys, *arguments)

    return run


def states(result: Result) -> list[str]:
    """What became of the pictures of a batch with --json, by their files' names."""
    assert result.code == 0, result.err
    records = [json.loads(line) for line in result.out.splitlines()]
    found = {record["output"]: record["event"] for record in records if "output" in record}
    return [found[output] for output in sorted(found)]


def value(path: str) -> np.ndarray:
    """Returns the value of the whole picture in a file [linear]."""
    pixels = read(path)[0][..., :3]
    assert np.all(pixels == pixels[0, 0])
    return pixels[0, 0]


def test_one_picture(run: Run) -> None:
    assert run("render", "s.toml", "-o", "x.exr", "--models", "models").code == 0
    assert value("x.exr") == pytest.approx(VALUE, rel=1e-3)
    assert run("render", "plain.toml", "-o", "x.exr", "--shaders", "own").code == 0
    assert value("x.exr") == pytest.approx(VALUE / 4, rel=1e-3)
    write(Path(), "own/brdf/chalk.glsl", CHALK_GLSL.replace("(NoL * NoL)", "(0.5 * NoL * NoL)"))
    assert run("render", "s.toml", "-o", "x.exr", *FOLDERS).code == 0
    assert value("x.exr") == pytest.approx(VALUE / 2, rel=1e-3)
    assert run("render", "s.toml", "-o", "x.exr", "--reference", "--models", "models").code == 0
    assert value("x.exr") == pytest.approx(VALUE, rel=1e-3)


def test_one_picture_resumes_until_a_file_is_edited(run: Run) -> None:
    command = ("render", "plain.toml", "-o", "x.exr", "--resume", "--json", "--shaders", "own", "--models", "models")
    assert states(run(*command)) == ["done"]
    assert states(run(*command)) == ["skipped"]
    write(Path(), "own/brdf/lambert.glsl", lambert("0.125"))
    assert states(run(*command)) == ["done"]
    assert states(run(*command)) == ["skipped"]
    # A model's Python file decides what its class gives to the GLSL.
    write(Path(), "models/_shared.py", "def squared(x):\n    return x * x\n")
    assert states(run(*command)) == ["done"]


def batch(run: Run, *workers: str) -> None:
    """Draws two pictures of each scene, edits shaders, and draws what has changed."""
    sweep = ("--sweep", "lights.0.intensity=1,0.5", "-o", "{scene}-{intensity}.exr")
    command = ("render", "s.toml", "plain.toml", *sweep, *workers, "--json", *FOLDERS)
    assert states(run(*command)) == ["done"] * 4
    for part in (1, 0.5):
        assert value(f"s-{part}.exr") == pytest.approx(part * VALUE, rel=1e-3)
        assert value(f"plain-{part}.exr") == pytest.approx(part * VALUE / 4, rel=1e-3)
    assert states(run(*command, "--resume")) == ["skipped"] * 4
    write(Path(), "own/brdf/lambert.glsl", lambert("0.125"))
    # The digest is of all shaders, so the other scene is drawn again too.
    assert states(run(*command, "--resume")) == ["done"] * 4
    assert value("plain-1.exr") == pytest.approx(VALUE / 8, rel=1e-3)


def test_a_batch_in_worker_processes(run: Run) -> None:
    batch(run, "--jobs", "2")


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("distributed") is None, reason="distributed is not installed")
def test_a_batch_on_a_cluster(run: Run) -> None:
    batch(run, "--cluster", "local", "--jobs", "2")


def test_verify(run: Run) -> None:
    assert "verified" in run("verify", "s.toml", "--models", "models").out
    assert run("verify", "plain.toml").code == 0
    # The reference is the model, whatever the folder's file says.
    assert run("verify", "plain.toml", "--shaders", "own").code == 6


def test_a_model_without_a_python_file(run: Run) -> None:
    glsl = CHALK_GLSL.replace("Chalk", "Slate")
    above = '"directional", direction = [0, -1, 0]'
    write(Path(), "slate.toml", SCENE.replace('"chalk"', '"slate"').replace('"zenith"', above))
    for option, folder, name in (("--shaders", "own", "own/brdf/slate.glsl"), ("--models", "models", "models/slate.glsl")):
        path = write(Path(), name, glsl)
        # Worker processes know the model, too.
        sweep = ("--sweep", "lights.0.intensity=1,0.5", "-o", "{intensity}.exr", "--jobs", "2", "--overwrite")
        assert run("render", "slate.toml", *sweep, option, folder).code == 0
        assert value("1.exr") == pytest.approx(VALUE, rel=1e-3)
        if shutil.which("glslangValidator"):
            done = run("verify", "slate.toml", option, folder)
            assert done.code == 0
            assert done.out.startswith("slate.toml: verified against its own text: ")
        done = run("render", "--reference", "-o", "x.exr", "slate.toml", option, folder)
        assert done.code == 7
        assert 'slate.glsl: the model "slate" has no reference' in done.err
        path.unlink()
    write(Path(), "models/slate.glsl", glsl)
    assert re.search(r"^slate .* no reference$", run("brdfs", "--models", "models").out, flags=re.MULTILINE)
    assert "reference: none" in run("brdfs", "slate", "--models", "models").out


def test_explain(run: Run) -> None:
    assert "chalk per pixel" in (said := run("explain", "s.toml", "--source", "--models", "models").out)
    assert "NoL * NoL" in said
    assert "0.25 * m.kd" in run("explain", "plain.toml", "--source", "--shaders", "own").out


def test_tradeoff(run: Run) -> None:
    options = ("--size", "8x8", "--repeat", "1", "--knobs", "storage", "--json")
    for scene, folders in (("s.toml", ("--models", "models")), ("plain.toml", ("--shaders", "own"))):
        done = run("tradeoff", scene, *options, "-o", scene.removesuffix(".toml"), *folders)
        assert done.code == 0, done.err
        points = json.loads(done.out)["points"]
        exact = min(point["total"]["max_abs"] for point in points)
        # The truth is the reference's: the shader folder's file gives a quarter of it.
        assert (exact > 0.1) == (scene == "plain.toml")


def test_bench(run: Run) -> None:
    done = run("bench", "brdfs", "chalk", "lambert", "--repeat", "1", "--json", *FOLDERS)
    assert done.code == 0, done.err
    sizes = {row["model"]: row["bytes"] for row in json.loads(done.out)["rows"]}
    assert sizes["chalk"] > 0
    assert sizes["lambert"] < size(BRDFS["lambert"]())


def test_lists(run: Run) -> None:
    assert "chalk" not in run("brdfs").out
    assert "chalk" in run("brdfs", "--models", "models").out
    assert "strength" in run("brdfs", "chalk", "--models", "models").out
    assert "zenith" in run("lights", "--models", "models").out
    # The option is read before the name, wherever it stands.
    assert "strength" in run("brdfs", "--models", "models", "chalk").out


COMMANDS = [
    ("render", "plain.toml", "-o", "x.png"),
    ("render", "plain.toml", "--jobs", "2", "--sweep", "lights.0.intensity=1,2"),
    ("verify", "plain.toml"),
    ("explain", "plain.toml"),
    ("tradeoff", "plain.toml"),
    ("bench", "brdfs", "lambert"),
]


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_a_wrong_folder_is_one_line(command: tuple[str, ...], run: Run) -> None:
    shutil.copytree("models", "broken")
    write(Path(), "broken/zenith.py", "class ZenithLight(:\n")
    write(Path(), "lonely/fast/math/lonely.glsl", "")
    for code, option, folder, says in (
        (3, "--models", "nowhere", "nowhere: is not a folder"),
        (3, "--models", "broken", r"zenith\.py: cannot be run: SyntaxError: "),
        (4, "--shaders", "nowhere", "nowhere: .*folder"),
        (4, "--shaders", "lonely", r"lonely\.glsl: "),
    ):
        done = run(*command, option, folder)
        assert done.code == code
        assert done.out == ""
        assert re.fullmatch(rf"glshade: \S*{says}.*\n", done.err)


def test_lists_tell_a_wrong_folder(run: Run) -> None:
    for command in ("brdfs", "lights"):
        done = run(command, "--models", "nowhere")
        assert (done.code, done.out) == (3, "")
        assert re.fullmatch(r"glshade: \S*nowhere: is not a folder\n", done.err)
