"""Mutations test the verifier: it must find every fault that is put in on purpose, wherever the fault changes the picture."""

from __future__ import annotations

import itertools
import re
from functools import cache
from pathlib import Path
from typing import Any, get_args

import pytest

import glshade
from glshade import Renderer
from glshade.glsl.generator import generate
from glshade.glsl.planner import plan
from glshade.glsl.source import Source
from glshade.radiance.readying import ready
from glshade.scene.object import Rate
from glshade.verification import mutations
from glshade.verification.mutations import MUTATIONS
from glshade.verification.trials import try_mutations

SCENES = sorted((Path(__file__).resolve().parents[2] / "scenes").glob("*.toml"))
# Every mutation shows in at least one of these scenes. The slow test takes the others too.
FEW = ("emission", "measured", "perspective-viewer", "spectral-metals")
# Every mutation matches a program of one of these.
MATCHED = (*FEW, "falloff")


def sized(path: Path, width: int) -> glshade.Scene:
    """Returns the scene of a file with one sample a pixel, another width [pixels] and the same aspect ratio."""
    scene = glshade.load(path)
    w, h = scene.film.size
    film = scene.film.model_copy(update={"size": (width, round(h * width / w)), "samples": 1})
    return scene.model_copy(update={"film": film})


def shown(path: Path, width: int, renderer: Renderer) -> set[str]:
    """Returns the names of the mutations that show in the scene. Fails where the verifier misses one of them."""
    trials = try_mutations(sized(path, width), renderer=renderer)
    missed = [f"{t.mutation.name}: changes {t.change:.1e}" for t in trials if t.shows and not t.caught]
    assert not missed, "\n".join(missed)
    return {t.mutation.name for t in trials if t.shows}


@cache
def shipped_sources() -> frozenset[Source]:
    """Returns the programs of the shipped scenes at every rate."""
    rates: tuple[Rate, ...] = get_args(Rate)
    scenes = [glshade.load(path) for path in SCENES if path.stem in MATCHED]
    plans = [plan(ready(scene, rate), "linear") for scene, rate in itertools.product(scenes, rates)]
    return frozenset(generate(program) for found in plans for program in found.programs)


def test_each_file_bears_the_name_of_its_mutation() -> None:
    files = {path.stem for path in Path(mutations.__file__).parent.glob("[!_]*.py")}
    assert files == {re.sub(r"\W", "_", name) for name in MUTATIONS}


@pytest.mark.parametrize("name", [name for name, mutation in MUTATIONS.items() if mutation.edits])
def test_the_edits_match_a_shipped_program(name: str) -> None:
    """A pattern that matches nothing would make the mutation the original program."""
    for pattern, _ in MUTATIONS[name].edits:
        assert any(re.search(pattern, stage.text) for source in shipped_sources() for stage in source.stages), pattern
    assert any(MUTATIONS[name].rewrite(source) != source for source in shipped_sources())


def test_every_mutation_shows_somewhere_and_is_caught(renderer: Renderer) -> None:
    found: set[str] = set()
    for path in SCENES:
        if path.stem in FEW:
            found |= shown(path, 128, renderer)
    assert found == set(MUTATIONS)


@pytest.mark.slow
@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_caught_in_every_scene(path: Path, renderer: Renderer) -> None:
    assert len(shown(path, 256, renderer)) >= 10


def test_without_a_mutation_nothing_is_caught(renderer: Renderer) -> None:
    path = next(path for path in SCENES if path.stem == "gallery")
    verdict: Any = glshade.verify(sized(path, 128), renderer=renderer)
    assert verdict.verdict == "verified", str(verdict)
