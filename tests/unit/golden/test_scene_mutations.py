"""Planted faults: each mutation of a shipped scene is a regression, and `glshade compare` names the right cause."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import glshade as g
from glshade.driver.freedom import measure_freedom
from glshade.golden.pair import Pair
from glshade.golden.result import SceneVerdict
from glshade.golden.scene_judge import SceneJudge
from glshade.golden.sidecar import Driver, Origin
from glshade.image.image import Image
from glshade.scene.file import load
from glshade.verification.mutations import MUTATIONS, Mutation
from glshade.verification.trials import VISIBLE

# Scenes in which, together, every mutation shows, and the width of their pictures [pixels].
SCENES = ("simple-model", "falloff", "detail", "anisotropy", "perspective-viewer", "emission", "measured", "spectral-metals")
WIDTH = 160
# The only scene that is drawn in bands; it is there for the mutations of bands alone.
BANDS = "spectral-metals"
# The share of the visible faults whose cause must be named.
NAMED = 0.9

pytestmark = pytest.mark.slow


def _drawn(renderer: g.Renderer, scene: g.Scene, mutation: Mutation | None = None) -> Any:
    """Returns the linear picture of a scene, drawn with a mutation."""
    renderer.rewrite = mutation.rewrite if mutation is not None else None
    try:
        pixels = renderer.render(scene, dtype="float32").pixels.copy()
    finally:
        renderer.rewrite = None
    return mutation.picture(pixels) if mutation is not None and mutation.picture else pixels


def _scene(name: str) -> g.Scene:
    """Returns a shipped scene, small and with one sample a pixel, so that few pixels are uncertain."""
    scene = load(f"scenes/{name}.toml", {"film.samples": 1, "film.supersample": 1})
    width, height = scene.film.size
    return load(
        f"scenes/{name}.toml",
        {"film.samples": 1, "film.supersample": 1, "film.size": [WIDTH, round(height * WIDTH / width)]},
    )


@pytest.mark.parametrize("coded", [False, True], ids=["floats", "codes"])
def test_mutations_are_regressions_with_their_causes(coded: bool) -> None:
    wrong: list[str] = []
    number = 0
    shown: set[str] = set()
    with g.Renderer() as renderer:
        freedom = measure_freedom(renderer.context).as_dict()
        origin = Origin(made_by="driver", driver=Driver(renderer=renderer.context.renderer), freedom=freedom)
        for name in SCENES:
            scene = _scene(name)
            judge = SceneJudge(scene)
            clean = _drawn(renderer, scene)
            for mutation in MUTATIONS.values():
                if name == BANDS and not mutation.name.startswith("bands-"):
                    continue
                faulty = _drawn(renderer, scene, mutation)
                if coded and not np.isfinite(faulty).all():
                    continue
                pictures = [Image(p).encoded().pixels if coded else p for p in (clean, faulty)]
                difference = np.abs(pictures[0].astype(np.float64) - pictures[1]).max()
                if difference <= (1 if coded else VISIBLE):
                    continue
                shown.add(mutation.name)
                number += 1
                pair = Pair("", tuple("RGBA"[: clean.shape[2]]), *pictures)
                found = judge.judge(pair, origin, origin)
                assert found is not None
                assert found.verdict is SceneVerdict.REGRESSION, (name, mutation.name, found)
                kinds = {cause.kind for cause in found.causes}
                if not kinds & set(mutation.causes):
                    wrong.append(f"{name}, {mutation.name}: {[cause.text for cause in found.causes]}")
    never = set(MUTATIONS) - shown
    assert never <= ({"all-nan", "one-nan", "exponent-1-percent", "normal-0.1-degree", "light-1-percent"} if coded else set())
    assert len(wrong) <= (1 - NAMED) * number, f"{len(wrong)} of {number}:\n" + "\n".join(wrong)
