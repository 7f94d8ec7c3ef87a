"""Trials: applies mutations to a scene, and records whether the verifier rejects each faulty picture."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.driver.freedom import measure_freedom
from glshade.gl.renderer import Renderer
from glshade.glsl.source import Rewrite
from glshade.scene.object import Rate
from glshade.scene.scene import Scene
from glshade.verification.candidates import Candidates, find_candidates, one_sample
from glshade.verification.mutations import MUTATIONS, Mutation
from glshade.verification.verdict import Verdict, verdict_of

Array = NDArray[Any]

# A mutation is visible if it changes some value of the picture by more than this [linear]. It is a quarter of the step between
# two 8-bit codes.
VISIBLE = 1e-3


@dataclass(frozen=True, eq=False)
class Trial:
    """The result of one mutation on one scene.

    mutation: the fault.
    change: the largest difference that the fault makes to any value of the picture [linear]; NaN if the picture has NaN.
    verdict: the verifier's verdict on the faulty picture; None if the fault changes nothing.
    """

    mutation: Mutation
    change: float
    verdict: Verdict | None

    @property
    def shows(self) -> bool:
        """Whether the fault changes the picture visibly. NaN counts as visible."""
        return not self.change <= VISIBLE

    @property
    def caught(self) -> bool:
        """Whether the verifier rejects the faulty picture."""
        return self.verdict is not None and self.verdict.verdict == "failed"


def try_mutations(
    scene: Scene,
    names: Iterable[str] = MUTATIONS,
    *,
    renderer: Renderer,
    shading: Rate | None = None,
    expected: Candidates | None = None,
    derived: bool = False,
) -> list[Trial]:
    """Draws the scene with one mutation at a time and one sample a pixel, and has the verifier judge each picture.

    With several samples, small faults may hide in the hulls of a dense mesh, whose every pixel has edges.
    names: the mutations to try; the default is all.
    renderer: draws the pictures. Its `rewrite` is None afterwards.
    shading: the rate for the whole scene; the default is each object's own.
    expected: the candidates of the scene with one sample a pixel, if they are known already.
    derived: True to compare with the GLSL before it is mutated, run in float64, and not with the models' Python functions.
    Errors: those of `Renderer.render`.
    """
    scene = one_sample(scene)
    if expected is None:
        driver, shaders = measure_freedom(renderer.context), renderer.current_shaders()
        expected = find_candidates(scene, shading=shading, driver=driver, derived=derived, shaders=shaders)

    def draw(rewrite: Rewrite | None) -> Array:
        renderer.rewrite = rewrite
        try:
            # The renderer reuses the array for its next picture, so this one is copied.
            pixels: Array = renderer.render(scene, dtype="float32", shading=shading).pixels.copy()
        finally:
            renderer.rewrite = None
        return pixels

    clean = draw(None)
    result = []
    for name in names:
        mutation = MUTATIONS[name]
        picture = mutation.picture(clean) if mutation.picture else draw(mutation.rewrite)
        change = float(np.abs(picture.astype(np.float64) - clean).max())
        verdict = None if change == 0 else verdict_of(picture, expected, explain=False)
        result.append(Trial(mutation, change, verdict))
    return result
