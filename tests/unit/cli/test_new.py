"""`glshade new`: the files that it writes are a complete model, which is drawn, verified and keeps the laws of models."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from support.command import Result, run_command
from support.extremes import at_extremes, unit, upward
from support.folders import SCENE, forget_models, write

from glshade import BRDFS, Renderer, evaluate
from glshade.catalogue.albedo import directional_albedo
from glshade.cli.new import KINDS
from glshade.scene.models import use_models

Run = Callable[..., Result]


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """`run(*arguments)` as `glshade`, in an empty folder."""
    monkeypatch.chdir(tmp_path)
    forget_models(monkeypatch)
    return lambda *arguments: run_command(capsys, *arguments)


def test_the_model_is_drawn_verified_and_listed(run: Run, tmp_path: Path) -> None:
    done = run("new", "brdf", "rough_thing", "--folder", "mine")
    assert done.code == 0
    assert done.out.startswith("mine/rough_thing.glsl\nmine/rough_thing.py\n")
    assert sorted(path.name for path in (tmp_path / "mine").iterdir()) == ["rough_thing.glsl", "rough_thing.py"]
    text = SCENE.replace('brdf = "chalk", tint', 'brdf = "rough_thing", kd').replace("zenith", "directional")
    write(tmp_path, "s.toml", text)
    assert run("render", "s.toml", "-o", "x.png", "--models", "mine").code == 0
    assert "verified" in run("verify", "s.toml", "--models", "mine").out
    assert run("check", "s.toml", "--models", "mine").code == 0
    listed = run("brdfs", "rough_thing", "--models", "mine").out
    assert listed.count("kept: ") == 2


def test_the_model_keeps_the_laws(run: Run, renderer: Renderer) -> None:
    run("new", "brdf", "fresh")
    use_models("models")
    l, v = unit(upward(256, 1)), unit(upward(256, 2))
    for material in at_extremes("fresh", 24):
        value = evaluate(material, l, v)
        assert np.allclose(value / l[:, 2:], evaluate(material, v, l) / v[:, 2:], rtol=1e-5)
        assert directional_albedo(material, v[:4]).max() <= 1 + 1e-5
        for on in ("vertex", "fragment"):
            assert np.allclose(evaluate(material, l, v, on, renderer.context), value, atol=2e-6)  # type: ignore[arg-type]
    assert BRDFS["fresh"].source


def test_nothing_is_replaced(run: Run, tmp_path: Path) -> None:
    path = write(tmp_path, "models/mine.py", "mine")
    done = run("new", "brdf", "mine")
    assert done.code == 2
    assert "models/mine.py exists already" in done.err
    assert path.read_text() == "mine"
    assert not path.with_suffix(".glsl").exists()


@pytest.mark.parametrize("name", ["Phong", "my-model", "1st", "a__b", "../a", "phong", ""])
def test_names_that_are_refused(name: str, run: Run, tmp_path: Path) -> None:
    assert run("new", "brdf", name).code == 2
    assert not list(tmp_path.iterdir())


def test_the_help_lists_the_kinds(run: Run) -> None:
    shown = run("new", "--help").out
    assert all(kind in shown for kind in KINDS)
