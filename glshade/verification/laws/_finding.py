"""Finding: the outcome of one law on one scene."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from glshade.driver.freedom import measure_freedom
from glshade.reference.freedom import LLVMPIPE, Freedom
from glshade.reference.picture import radiance
from glshade.reference.shade import Sampling
from glshade.scene.object import Rate
from glshade.scene.scene import Scene
from glshade.verification.candidates import find_candidates, one_sample
from glshade.verification.judgement import Expected, PixelClass, judge
from glshade.verification.laws._law import Draw, Law, NotApplicableError
from glshade.verification.laws._scenes import with_quality

Array = NDArray[Any]
DrawnBy = Literal["reference", "gpu"]

# The factor by which intervals are wider than those of a verification. A correct picture of the unchanged scene may be off by
# one tolerance, and a correct picture of the changed scene by as much in the other direction.
ROOM = 2.0


@dataclass(frozen=True)
class Finding:
    """The outcome of one law on one scene, drawn by one renderer.

    A law's picture is compared with the values that the float64 reference allows the pixels of the unchanged scene, with twice
    the tolerance of a verification. Ambiguous pixels, such as outlines, are left out.

    law: the law's name.
    drawn_by: "reference" for the float64 reference, "gpu" for OpenGL.
    reason: why the law does not apply to the scene; empty if it applies.
    pixels: number of pixels that are compared.
    broken: number of pixels whose value is outside every allowed interval.
    deviation: largest distance of a pixel's value from the reference's value for the unchanged scene [linear].
    allowance: largest tolerance of any pixel [linear].
    used: largest ratio of a pixel's deviation to the tolerance of the same pixel.
    """

    law: str
    drawn_by: DrawnBy
    reason: str = ""
    pixels: int = 0
    broken: int = 0
    deviation: float = 0.0
    allowance: float = 0.0
    used: float = 0.0

    @property
    def outcome(self) -> Literal["holds", "broken", "does not apply"]:
        """Whether the law holds."""
        if self.reason:
            return "does not apply"
        return "broken" if self.broken else "holds"


def findings(scene: Scene, laws: Sequence[Law], renderer: Any) -> Iterator[Finding]:
    """Yields one Finding for each law and renderer. The arguments and errors are those of `check_laws`."""
    driver = LLVMPIPE if renderer is None else measure_freedom(renderer.context)
    draws: dict[DrawnBy, Draw] = {"reference": _by_reference(driver)}
    if renderer is not None:
        draws["gpu"] = _on(renderer)
    scene = _tried(scene)
    unchanged = _allowed(scene, driver)

    @cache
    def premised(premise: Callable[[Scene], Scene]) -> tuple[Scene, Expected]:
        base = premise(scene)
        return base, unchanged if base is scene else _allowed(base, driver)

    for law in laws:
        try:
            base, expected = premised(law.premise)
            for drawn_by, draw in draws.items():
                yield _found(law, drawn_by, expected, law.picture(base, draw))
        except NotApplicableError as reason:
            yield from (Finding(law.name, drawn_by, str(reason)) for drawn_by in draws)


def _tried(scene: Scene) -> Scene:
    """Returns the scene without crop, with one sample a pixel, and without adaptive refinement.

    `quality.refine` cuts the triangles whose interpolated light has an error above a threshold. A rounding error could move a
    triangle over this threshold, so that no law would hold.
    """
    scene = with_quality(one_sample(scene), refine=None)
    return scene.model_copy(update={"film": scene.film.model_copy(update={"crop": None})})


def _allowed(scene: Scene, driver: Freedom) -> Expected:
    """Returns the values that the pixels of a law's picture of a scene may have."""
    expected = find_candidates(scene, driver=driver).expected
    low, high, centre = expected.low, expected.high, expected.centre
    return replace(expected, low=centre - ROOM * (centre - low), high=centre + ROOM * (high - centre))


def _by_reference(driver: Freedom) -> Draw:
    """Returns a `Draw` that draws with the float64 reference, which decodes the codes of textures as the driver does."""
    sampling = Sampling(decoded=driver.decoded)

    def draw(scene: Scene, *, shading: Rate | None = None, tile: int | None = None) -> Array:
        picture: Array = radiance(scene, shading=shading, sampling=sampling)[..., : len(scene.film.background)]
        return picture

    return draw


def _on(renderer: Any) -> Draw:
    """Returns a `Draw` that draws with a Renderer."""

    def draw(scene: Scene, *, shading: Rate | None = None, tile: int | None = None) -> Array:
        # The renderer reuses its array for the next picture, so this one is copied.
        picture: Array = renderer.render(scene, dtype="float32", shading=shading, tile=tile).pixels.copy()
        return picture

    return draw


def _found(law: Law, drawn_by: DrawnBy, expected: Expected, picture: Array) -> Finding:
    """Returns the Finding for the picture of a law that applies."""
    width, height = expected.size
    ambiguous = np.isin(expected.classes, [kind for kind in PixelClass if kind.ambiguous]).reshape(height, width)
    comparison = judge(picture, expected, mask=ambiguous)
    return Finding(
        law.name,
        drawn_by,
        pixels=int((~ambiguous).sum()),
        broken=comparison.unexplained,
        deviation=comparison.worst,
        allowance=comparison.tolerance,
        used=float(comparison.used[~ambiguous].max(initial=0.0)),
    )
