"""Who checks the checker: faults put in on purpose must be found wherever they show."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import glshade
from glshade.verification.mutations import MUTATIONS, MutatedRenderer, trials

SCENES = sorted((Path(__file__).resolve().parents[2] / "scenes").glob("*.toml"))
# Between them these show every mutation; the others follow in the slow run.
FEW = ("anisotropy", "detail", "falloff", "perspective-viewer", "shading-rates", "spot")


@pytest.fixture(scope="module")
def mutated() -> Iterator[MutatedRenderer]:
    with MutatedRenderer() as renderer:
        yield renderer


def sized(path: Path, width: int) -> glshade.Scene:
    scene = glshade.load(path)
    w, h = scene.film.size
    return scene.model_copy(update={"film": scene.film.model_copy(update={"size": (width, round(h * width / w))})})


def tried(path: Path, width: int, renderer: MutatedRenderer) -> set[str]:
    """The mutations that show in the scene; fails for one that survives."""
    found = trials(sized(path, width), renderer=renderer)
    survived = [f"{t.mutation.name}: changes {t.change:.1e}" for t in found if t.shows and not t.caught]
    assert not survived, "\n".join(survived)
    return {t.mutation.name for t in found if t.shows}


def test_every_mutation_shows_somewhere_and_is_caught(mutated: MutatedRenderer) -> None:
    shown: set[str] = set()
    for path in SCENES:
        if path.stem in FEW:
            shown |= tried(path, 128, mutated)
    assert shown == set(MUTATIONS)


@pytest.mark.slow
@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_caught_in_every_scene(path: Path, mutated: MutatedRenderer) -> None:
    assert len(tried(path, 256, mutated)) >= 10


def test_without_a_mutation_nothing_is_caught(mutated: MutatedRenderer) -> None:
    path = next(path for path in SCENES if path.stem == "gallery")
    verdict: Any = glshade.verify(sized(path, 128), renderer=mutated)
    assert verdict.verdict == "verified", str(verdict)
