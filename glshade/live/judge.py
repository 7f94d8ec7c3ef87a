"""Judge: the process that compares a view with the float64 reference. It has a low priority, so that drawing comes first.

It starts from the drawer's snapshot, and draws the view itself with the same driver.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.debug.pixels import Pixels, Variable
from glshade.driver.freedom import measure_freedom
from glshade.errors import NoReference, SceneError
from glshade.image.image import Image
from glshade.image.view import displayed
from glshade.live.child import serve
from glshade.live.messages import (
    Answer,
    Frame,
    Heat,
    Judged,
    Loaded,
    LostDigits,
    MeasureDigits,
    Probe,
    Probed,
    Reference,
    Request,
    Restore,
    ShowVariable,
    Trace,
    Traced,
    Verify,
    View,
)
from glshade.live.snapshot import restored
from glshade.live.variables import hexadecimal, line_tables, step_tables, variable_picture
from glshade.live.views import Views
from glshade.live.worker import RenderWorker
from glshade.page.ramp import RAMP, heat
from glshade.reference.picture import render
from glshade.scene.scene import Scene
from glshade.verification.candidates import Candidates, at_centres, find_candidates, judgeable, left_out
from glshade.verification.judgement import PixelClass
from glshade.verification.report import CLASS_MEANING
from glshade.verification.verdict import Verdict, verdict_of

Array = NDArray[Any]
# The number of unexplained pixels that are listed.
LISTED = 200


@dataclass(frozen=True, eq=False)
class Trial:
    """A view that was judged.

    scene: its scene, without the settings that are not judged.
    expected: the values that its pixels may have.
    verdict: the result.
    left_out: the settings of the view that were not judged.
    """

    scene: Scene
    expected: Candidates
    verdict: Verdict
    left_out: tuple[str, ...]


class Judge(RenderWorker):
    """Judges views of one revision."""

    def __init__(self, backend: str, device: str, folder: str) -> None:
        """Does not open a context yet.

        backend, device: as for RenderWorker.
        folder: not used; the drawer takes the same arguments.
        """
        super().__init__(backend, device)
        self.handlers = {
            Restore: self._restore,
            Verify: self._verify,
            Probe: self._probe,
            Reference: self._reference,
            Heat: self._heat,
            Trace: self._trace,
            ShowVariable: self._variable,
            MeasureDigits: self._digits,
        }
        self._views: Views | None = None
        # The last view that was judged, because a probe or a heat map of the same view often follows.
        self._last: tuple[Scene, str | None, Trial] | None = None
        # The last view whose programs were run on the CPU.
        self._pixels: tuple[Scene, str | None, Pixels] | None = None

    def _restore(self, request: Restore) -> Answer:
        revision = restored(Path(request.folder))
        self._views, self._last, self._pixels = Views(revision), None, None
        return Loaded(id=request.id, revision=revision.number, shown=revision.number, snapshot=request.folder)

    def _verify(self, request: Verify) -> Answer:
        start = perf_counter()
        try:
            trial = self._trial(request.view)
        except NoReference as error:
            return Judged(id=request.id, verdict="none", text=str(error), revision=self._number)
        verdict = trial.verdict
        rows, columns = np.nonzero(verdict.comparison.excess > 0)
        ambiguous = sum(number for kind, number in verdict.comparison.counts.items() if kind.ambiguous)
        return Judged(
            id=request.id,
            verdict=verdict.verdict,
            text=_sentence(trial),
            derived=trial.verdict.derived,
            unexplained=verdict.unexplained,
            ambiguous=ambiguous,
            pixels=[(int(x), int(y)) for x, y in zip(columns[:LISTED], rows[:LISTED], strict=True)],
            revision=self._number,
            seconds=perf_counter() - start,
        )

    def _probe(self, request: Probe) -> Answer:
        trial = self._trial(request.view)
        width, height = trial.expected.expected.size
        if not (0 <= request.x < width and 0 <= request.y < height):
            raise SceneError(f"the pixel {request.x}, {request.y} lies outside the picture, which is {width} x {height}")
        pixel = request.y * width + request.x
        value = trial.verdict.picture[request.y, request.x]
        expected, comparison = trial.expected.expected, trial.verdict.comparison
        nearest = int(comparison.candidate[pixel])
        low, high, centre = (
            (part[nearest] if nearest >= 0 else expected.background)[: len(value)]
            for part in (expected.low, expected.high, expected.centre)
        )
        owner, triangle = trial.expected.owner(nearest)
        kind = PixelClass(int(trial.verdict.classes[request.y, request.x]))
        explained = comparison.excess[request.y, request.x] <= 0
        return Probed(
            id=request.id,
            x=request.x,
            y=request.y,
            value=_numbers(value),
            reference=_numbers(centre),
            low=_numbers(low),
            high=_numbers(high),
            kind=kind.name.lower(),
            object=owner if triangle >= 0 else None,
            triangle=triangle if triangle >= 0 else None,
            text=f"{'explained' if explained else 'not explained'}: {CLASS_MEANING[kind]}",
            revision=self._number,
        )

    def _reference(self, request: Reference) -> Answer:
        start = perf_counter()
        scene, shading = self._scene(request.view)
        film = scene.film
        try:
            image = render(scene, shading=shading)
        except NoReference:
            # The value in the middle of what the model's own text allows takes the place of a reference.
            image = Image(self._trial(request.view).verdict.reference)
        shown = displayed(image, film.encoding, ocio=film.ocio, display=film.display, view=film.view)
        return self._frame(request, shown, start)

    def _heat(self, request: Heat) -> Answer:
        start = perf_counter()
        colours, low, high = heat(self._trial(request.view).verdict.comparison.error)
        scale = {
            "low": low,
            "high": high,
            "text": "difference from the reference, linear light, on a logarithmic scale",
            "colours": hexadecimal([*RAMP]),
        }
        return self._frame(request, Image(colours, "srgb"), start, scale)

    def _trace(self, request: Trace) -> Answer:
        trace = self._seen(request.view).trace(request.x, request.y)
        steps = step_tables(trace.steps)
        return Traced(
            id=request.id,
            x=request.x,
            y=request.y,
            object=None if trace.number < 0 else trace.number,
            steps=steps,
            left_out=len(trace.steps) - len(steps),
            revision=self._number,
        )

    def _variable(self, request: ShowVariable) -> Answer:
        start = perf_counter()
        asked = request.view.get("variable")
        if not asked:
            raise SceneError("the view names no variable: probe a pixel and choose one of its variables")
        pixels = self._seen(request.view)
        variable = Variable(asked["place"], asked["name"], asked.get("number", 0))
        values, present = pixels.values(asked["object"], variable)
        colours, scale = variable_picture(values, variable.name, present)
        return self._frame(request, Image(colours, "srgb"), start, scale)

    def _digits(self, request: MeasureDigits) -> Answer:
        lines = line_tables(self._seen(request.view).digits(request.object))
        return LostDigits(id=request.id, object=request.object, lines=lines, revision=self._number)

    def _seen(self, view: View) -> Pixels:
        """Returns the surfaces of a view with their programs, from memory if it is the last one. Errors: SceneError."""
        scene, shading = self._scene(view)
        assert self._views is not None
        self._views.revision.draw_with(self.renderer)
        if self._pixels is None or self._pixels[0] is not scene or self._pixels[1] != shading:
            self._pixels = scene, shading, Pixels(scene, self._views.revision.shaders, shading)
        return self._pixels[2]

    def _frame(self, request: Request, image: Image, start: float, scale: dict[str, Any] | None = None) -> Frame:
        height, width, _ = image.shape
        drawn = perf_counter()
        data = image.png()
        times = {"draw": 1000 * (drawn - start), "encode": 1000 * (perf_counter() - drawn)}
        return Frame(
            id=request.id,
            data=data,
            width=width,
            height=height,
            revision=self._number,
            milliseconds=times,
            scale=scale,
        )

    @property
    def _number(self) -> int:
        """The number of the revision that is judged; 0 where there is none."""
        return self._views.revision.number if self._views else 0

    def _scene(self, view: View) -> tuple[Scene, Any]:
        """Returns the scene of a view and the rate that replaces those of its objects. Errors: SceneError."""
        if self._views is None:
            raise SceneError("there is no picture yet")
        return self._views.shown({**view, "layer": None}).scene, view.get("shading")

    def _trial(self, view: View) -> Trial:
        """Returns the result for a view, from memory if it is the last one. Errors: NoReference, SceneError, ShaderError."""
        scene, shading = self._scene(view)
        if self._last is None or self._last[0] is not scene or self._last[1] != shading:
            self._last = scene, shading, self._judged(scene, shading)
        return self._last[2]

    def _judged(self, scene: Scene, shading: Any) -> Trial:
        """Draws a scene and compares it with the reference."""
        assert self._views is not None
        self._views.revision.draw_with(self.renderer)
        judged, more = at_centres(judgeable(scene))
        # The reference comes first: a model that has none is refused before anything is drawn.
        driver, shaders = measure_freedom(self.renderer.context), self._views.revision.shaders
        expected = find_candidates(judged, shading=shading, driver=driver, shaders=shaders)
        picture = self.renderer.render(judged, dtype="float32", shading=shading).pixels.copy()
        return Trial(judged, expected, verdict_of(picture, expected, explain=False), (*left_out(scene), *more))


def _sentence(trial: Trial) -> str:
    """Returns a verdict as one sentence."""
    verdict, against, reference = trial.verdict, "", "the float64 reference"
    if trial.verdict.derived:
        against, reference = " against its own text", "its GLSL, run in float64"
    if verdict.verdict == "verified":
        text = f"verified{against}: all pixels agree with {reference}, {verdict.ambiguous:.1%} of them are ambiguous"
    else:
        text = f"{verdict.verdict}{against}: {'; '.join(verdict.reasons)}"
    return f"{text}; not judged: {', '.join(trial.left_out)}" if trial.left_out else text


def _numbers(values: Array) -> list[float]:
    return [float(value) for value in values]


if __name__ == "__main__":
    serve(Judge)
