"""Scene judge: judges two pictures of a scene by the values that the float64 reference allows, and names what went wrong."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from glshade.errors import ContextError, GlshadeError, NoReference
from glshade.golden.result import Cause, Outcome, SceneVerdict
from glshade.golden.rules.codes import MOST_MOVED, SHARE_MOVED, close
from glshade.lru import Lru

# The modules of the scene and of the reference are imported where they are needed: most comparisons have no scene.
if TYPE_CHECKING:
    from glshade.golden.pair import Pair
    from glshade.golden.sidecar import Origin
    from glshade.reference.freedom import Freedom
    from glshade.scene.models import Folders
    from glshade.scene.scene import Scene
    from glshade.verification.candidates import Candidates
    from glshade.verification.verdict import Verdict

Array = NDArray[Any]
Flags = NDArray[np.bool_]

# The largest share of the pixels that may differ by more than a code because drivers differ. It is the share of ambiguous
# pixels up to which `glshade verify` decides.
MOST_FREE = 0.03
# The number of scenes, and of scenes with a driver, that are kept ready. Pairs of the same scene usually follow one another.
KEPT = 4


@dataclass(frozen=True)
class SceneFinding:
    """The judgement of a pair by its scene.

    verdict: the verdict; None where the reference cannot judge.
    reason: one sentence that says why; empty for SAME and FREEDOM.
    causes: as in `Result`.
    notes, classes: as in `Result`.
    """

    verdict: SceneVerdict | None
    reason: str = ""
    causes: tuple[Cause, ...] = ()
    notes: tuple[str, ...] = ()
    classes: NDArray[np.uint8] | None = None


class SceneJudge:
    """Judges pictures by their scenes. It keeps the scenes and what the reference allows, so one of them serves many pairs."""

    def __init__(
        self,
        scene: Path | Scene | None = None,
        overrides: Sequence[tuple[str, str]] = (),
        *,
        backend: Any = "auto",
        device: int | None = None,
        models: Folders | None = None,
        shaders: Folders | None = None,
        explain: bool = True,
    ) -> None:
        """Takes the scene of all pairs. By default, the sidecar of each reference picture names the scene.

        overrides: values that replace those of the scene's file, as pairs of key and text.
        models, shaders: folders of the user's own models and shaders, as for `load`.
        explain: False to leave out the search for the causes of a regression, which takes 0.3 s or more.
        backend, device: the OpenGL context of the driver at hand, as for Renderer. It is opened when a picture names a driver
            whose errors its sidecar does not hold; they are measured if it is the driver at hand.
        """
        self.scene = scene
        self._overrides = tuple(overrides)
        self._backend, self._device = backend, device
        self._models, self._shaders, self._explain = models, shaders, explain
        # The number of entries bounds them, and not their size.
        self._scenes: Lru[Any, Scene] = Lru(0, most=KEPT)
        self._candidates: Lru[Any, Candidates] = Lru(0, most=KEPT)
        self._at_hand: tuple[str, str, Freedom | None] | None = None
        # Folders are compared in several threads, which share the caches and the OpenGL context.
        self._lock = Lock()

    def path_for(self, reference: Origin) -> str:
        """Returns the path of the scene that judges a pair; empty where there is none, or where the scene has no file.

        reference: the origin of the reference picture.
        """
        if self.scene is None:
            return reference.scene or ""
        return str(self.scene) if isinstance(self.scene, Path) else ""

    def judge(self, pair: Pair, reference: Origin, test: Origin, mask: Flags | None = None) -> SceneFinding | None:
        """Returns the judgement of the picture layer of two files; None where no scene is known.

        pair: the layer, in which some pixel differs.
        reference, test: the origins of the two pictures.
        mask: optional (H, W), the pixels that are left out.
        Errors: GlshadeError where the scene, or the context that was asked for, cannot be used.
        """
        if self.scene is None and reference.scene is None:
            return None
        if pair.channels not in (("R", "G", "B"), ("R", "G", "B", "A")):
            return _not_judged("only pictures with the channels R, G, B or R, G, B, A are judged")
        with self._lock:
            return self._by_scene(pair, reference, test, mask)

    def _by_scene(self, pair: Pair, reference: Origin, test: Origin, mask: Flags | None) -> SceneFinding:
        """Returns the judgement of a pair by its scene. Errors: those of `judge`."""
        scene, name = self._loaded(reference)
        width, height = scene.film.window[2:]
        if pair.test.shape[:2] != (height, width):
            raise GlshadeError(
                f"{name}: its picture has {width}x{height} pixels, and the compared ones have {pair.test.shape[1]}x"
                f"{pair.test.shape[0]}; give the scene with the film's size that they were drawn with"
            )
        if not pair.finite:
            return _not_finite(pair)
        try:
            return self._judged(_Case(pair, mask, scene, name, reference, test))
        except NoReference as error:
            return _not_judged(str(error))

    def _judged(self, case: _Case) -> SceneFinding:
        """Returns the judgement of finite pictures. Errors: NoReference where the reference cannot judge."""
        new = self._verdict(case, case.pair.test, case.test)
        found = self._finding(case, new)
        if found.verdict is None or found.verdict.outcome is Outcome.SAME:
            return found
        from glshade.verification.report import class_map

        return replace(found, classes=class_map(new.classes, new.comparison.excess))

    def _finding(self, case: _Case, new: Verdict) -> SceneFinding:
        """Returns the judgement without the classes.

        Ambiguous pixels are no reason not to decide here: what counts is how many of them differ.
        new: the verdict on the test picture.
        """
        far = self._far(case)
        old_is_right = self._old_is_right(case)
        if new.verdict == "failed":
            noise = self._is_noise(case, far)
            causes = self._causes(case, new, old_is_right, search=self._explain or noise)
            if not noise or causes[0].kind != "unknown":
                wrong = f"{new.unexplained} {'pixel is' if new.unexplained == 1 else 'pixels are'} not what the scene allows"
                return SceneFinding(SceneVerdict.REGRESSION, wrong, causes)
        if not old_is_right:
            return SceneFinding(SceneVerdict.STALE, "only the new picture is what the scene allows; approve it")
        if not far.any():
            return SceneFinding(SceneVerdict.SAME)
        count = int(np.count_nonzero(far))
        same_driver = _same_driver(case.reference, case.test)
        # A driver draws the same scene alike each time, up to the few pixels that the rule `codes` allows for.
        most = max(MOST_MOVED, SHARE_MOVED * far.size) if same_driver else MOST_FREE * far.size
        if case.reference.made_by == "reference":
            # At edges, the reference's picture is one of many that the scene allows, and no driver's.
            most = far.size
        if count <= most and not (far & ~self._free(case)).any():
            return SceneFinding(SceneVerdict.FREEDOM)
        pixels = "pixel differs" if count == 1 else "pixels differ"
        differ = f"the scene allows both pictures, and {count} {pixels} by more than 1 code"
        if same_driver:
            return SceneFinding(SceneVerdict.BOTH_RIGHT, f"{differ}, although one driver drew both: has the scene changed?")
        driver = f" of {case.test.driver.family}" if case.test.driver is not None else ""
        return SceneFinding(SceneVerdict.BOTH_RIGHT, f"{differ}; approve the new one as a variant{driver}?")

    def _is_noise(self, case: _Case, far: Flags) -> bool:
        """Returns whether a wrong picture of 8-bit codes is wrong by no more than one code beside the reference picture.

        far: (H, W), the pixels that differ by more than a code.
        """
        if case.pair.test.dtype != np.uint8:
            return False
        without = np.where(far[..., None], case.pair.test, case.pair.reference)
        return self._verdict(case, without, case.test, explain=False).verdict != "failed"

    def _old_is_right(self, case: _Case) -> bool:
        """Returns whether the scene allows the reference picture."""
        if case.reference.made_by == "reference":
            from glshade.scene.digest import scene_digest

            # The reference's picture of this very scene is right by definition.
            return case.reference.scene_digest in (None, scene_digest(case.scene))
        return self._verdict(case, case.pair.reference, case.reference, explain=False).verdict != "failed"

    def _causes(self, case: _Case, new: Verdict, old_is_right: bool, search: bool) -> tuple[Cause, ...]:
        """Returns the causes that make a picture wrong, at least one.

        new: the verdict on the picture.
        search: False to return the place where it is most wrong, and not to look for the fault.
        """
        from glshade.golden.cause import scene_causes
        from glshade.golden.wrong_place import worst_group

        candidates = self._candidates_of(case, case.test)
        group = worst_group(new, candidates)
        if not search:
            return (group,)
        right = case.pair.reference if old_is_right else None
        test = case.pair.test
        if case.mask is not None:
            test = np.where(case.mask[..., None], new.reference if right is None else right, test)
        causes = scene_causes(case.scene, candidates, new.reference, test, right)
        return tuple(_placed(cause, group) for cause in causes) or (group,)

    def _far(self, case: _Case) -> Flags:
        """Returns the pixels (H, W) that differ by more than a code."""
        pair = case.pair
        far = np.zeros(pair.changed.shape, dtype=np.bool_)
        far[pair.changed] = ~close(*pair.changed_values, pair.channels)
        return far if case.mask is None else far & ~case.mask

    def _free(self, case: _Case) -> Flags:
        """Returns the pixels (H, W) in which drivers may differ by more than a code.

        They show a texture, or the values that the reference allows lie so far apart, as at outlines, ties and edges.
        """
        from glshade.golden.certainty import certain_pixels

        free = np.zeros(case.pair.changed.size, dtype=np.bool_)
        for origin in (case.reference, case.test):
            candidates = self._candidates_of(case, origin)
            free |= ~certain_pixels(candidates.expected)
            textured = np.array([bool(draw.pictures) for draw in candidates.inputs.draws] + [False])
            # The last entry stands for the background, whose number is -1.
            free[candidates.expected.pixel[textured[candidates.draw]]] = True
        return free.reshape(case.pair.changed.shape)

    def _verdict(self, case: _Case, pixels: Array, origin: Origin, explain: bool = True) -> Verdict:
        """Returns the verdict on one picture. Errors: NoReference."""
        from glshade.verification.encoded import judge_pixels

        candidates = self._candidates_of(case, origin)
        return judge_pixels(pixels, candidates, mask=case.mask, explain=explain)

    def _candidates_of(self, case: _Case, origin: Origin) -> Candidates:
        """Returns what the reference allows a picture of this origin to show. Errors: NoReference, SceneError."""
        from glshade.glsl.shaders import current
        from glshade.scene.models import paths
        from glshade.verification.candidates import find_candidates, judgeable

        freedom = self._freedom(origin)

        def find() -> Candidates:
            return find_candidates(judgeable(case.scene), driver=freedom, shaders=current(paths(self._shaders)))

        return self._candidates.find((case.name, freedom), find, _unsized)

    def _loaded(self, reference: Origin) -> tuple[Scene, str]:
        """Returns the scene of a pair, and its name for messages. Errors: SceneError."""
        if self.scene is not None and not isinstance(self.scene, Path):
            return self.scene, "the scene"
        from glshade.scene.file import load
        from glshade.scene.override import split

        path = self.path_for(reference)
        own = self._overrides if self.scene is not None else tuple(split(text) for text in reference.overrides)
        try:
            scene = self._scenes.find(
                (path, own), lambda: load(Path(path), own, models=self._models, shaders=self._shaders), _unsized
            )
        except OSError as error:
            raise GlshadeError(f"{path}: the scene cannot be read: {error.strerror or error}") from None
        return scene, " ".join([path, *("=".join(pair) for pair in own)])

    def _freedom(self, origin: Origin) -> Freedom:
        """Returns the freedom of the driver that drew a picture; all that OpenGL allows where the driver is not known."""
        from glshade.reference.freedom import UNMEASURED, Freedom

        if origin.freedom is not None:
            return Freedom.from_dict(origin.freedom)
        if origin.driver is None:
            return UNMEASURED
        renderer, version, freedom = self._driver_at_hand()
        if freedom is not None and renderer == origin.driver.renderer and origin.driver.version in ("", version):
            return freedom
        return UNMEASURED

    def _driver_at_hand(self) -> tuple[str, str, Freedom | None]:
        """Returns the name, the version and the freedom of the driver at hand; None in place of one that cannot be used.

        Errors: ContextError where the backend or the device was chosen and cannot be used.
        """
        if self._at_hand is None:
            self._at_hand = ("", "", None)
            with suppress(*(() if self._backend != "auto" or self._device is not None else (ContextError,))):
                from glshade.driver.freedom import measure_freedom
                from glshade.gl.context import open_context

                context = open_context(self._backend, self._device)
                try:
                    self._at_hand = (context.renderer, context.version, measure_freedom(context))
                finally:
                    context.release()
        return self._at_hand


@dataclass(frozen=True, eq=False)
class _Case:
    """One pair and its scene.

    pair: the picture layers.
    mask: optional (H, W), the pixels that are left out.
    scene: the scene.
    name: the scene's name for messages.
    reference, test: the origins of the two pictures.
    """

    pair: Pair
    mask: Flags | None
    scene: Scene
    name: str
    reference: Origin
    test: Origin


def _same_driver(one: Origin, other: Origin) -> bool:
    """Returns whether the same version of the same driver is known to have drawn two pictures."""
    if one.driver is None or other.driver is None:
        return False
    return (one.driver.renderer, one.driver.version) == (other.driver.renderer, other.driver.version)


def _placed(cause: Cause, group: Cause) -> Cause:
    """Returns a cause with the object and the triangle of the worst group of pixels, where they are not known or the same."""
    if cause.object not in ("", group.object):
        return cause
    return replace(cause, object=group.object, triangle=group.triangle)


def _not_finite(pair: Pair) -> SceneFinding:
    """Returns the finding on a pair with infinite or NaN values. Those of the reference picture are left to the rule."""
    from glshade.golden.whole_picture import not_finite

    if np.isfinite(pair.test).all():
        return SceneFinding(None)
    return SceneFinding(SceneVerdict.REGRESSION, "a value is infinite or NaN", (not_finite(pair.test),))


def _not_judged(reason: str) -> SceneFinding:
    """Returns the finding that leaves the judgement to the rule."""
    return SceneFinding(None, notes=(f"not judged by the reference: {reason}",))


def _unsized(_: object) -> int:
    """Returns the size of an entry in a cache that is bounded by the number of its entries."""
    return 0
