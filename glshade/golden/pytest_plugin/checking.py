"""Checking: compares the picture of a test with its baseline, stores the result, and says what is wrong."""

from __future__ import annotations

import filecmp
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

import numpy as np
from numpy.typing import NDArray

from glshade.errors import GlshadeError
from glshade.golden.baselines import rule_of
from glshade.golden.judge import compare_files, compare_variants
from glshade.golden.names import check_name
from glshade.golden.pytest_plugin import messages
from glshade.golden.pytest_plugin.pictures import SUFFIXES, Picture, from_array, take
from glshade.golden.pytest_plugin.run import Run
from glshade.golden.result import Outcome, Result
from glshade.golden.results import Case, case_of
from glshade.golden.rules import RULES, Rule
from glshade.golden.rules.exact import Exact
from glshade.golden.scene_judge import SceneJudge
from glshade.golden.sidecar import Origin, drawn_by, origin_of
from glshade.image.file import parts
from glshade.image.formats import FORMATS
from glshade.scene.override import split


@dataclass(frozen=True, eq=False)
class Request:
    """One check that a test asks for.

    node_id: the test's node id.
    draw: a function that returns the picture, as a test may hand it over.
    ready_made: whether `draw` returns the same object each time.
    rule: the rule; None for the one in the baseline's sidecar.
    mask: optional (H, W), True where a pixel is left out.
    overrides: values that replace those of a scene file, as `--set` takes them.
    """

    node_id: str
    draw: Callable[[], object]
    ready_made: bool
    rule: Rule | None
    mask: NDArray[np.bool_] | None
    overrides: tuple[str, ...]

    @classmethod
    def of(
        cls,
        node_id: str,
        draw: Callable[[], object],
        ready_made: bool,
        *,
        rule: object = None,
        mask: object = None,
        overrides: Sequence[str] = (),
    ) -> Request:
        """Returns a request with the arguments that a test gives. Errors: GlshadeError, which names the argument."""
        return cls(node_id, draw, ready_made, _rule(rule), None if mask is None else _mask(mask), _overrides(overrides))


def _rule(given: object) -> Rule | None:
    """Returns a test's rule, given by its name or as a Rule. Errors: GlshadeError where no rule has the name."""
    if given is None or isinstance(given, Rule):
        return given
    if isinstance(given, str) and given in RULES:
        return RULES[given]()
    raise GlshadeError(f"rule={given!r} is no rule; it must be one of {', '.join(map(repr, sorted(RULES)))}, or a Rule")


def _mask(given: object) -> NDArray[np.bool_]:
    """Returns the mask that a test gives. Errors: GlshadeError where it is not (H, W) of bool."""
    mask = np.asarray(given)
    if mask.dtype != np.bool_ or mask.ndim != 2:
        raise GlshadeError(
            f"mask= must be an array (H, W) of bool, True where a pixel is left out; it is {mask.dtype} of shape {mask.shape}"
        )
    return mask


def _overrides(given: Sequence[str]) -> tuple[str, ...]:
    """Returns the overrides that a test gives. Errors: GlshadeError where they are no list of texts KEY=VALUE."""
    texts = (given,) if isinstance(given, str) else tuple(given)
    try:
        for text in texts:
            split(text)
    except (TypeError, ValueError) as error:
        raise GlshadeError(f"overrides= must be a list of texts: {error}") from None
    return texts


def full_name(name: str, suffix: str) -> str:
    """Returns the name of a baseline with a suffix: its own, or else the given one. Errors: GlshadeError for a bad name."""
    own = Path(name).suffix.lower()
    if own not in SUFFIXES and own[1:] in FORMATS:
        raise GlshadeError(f"name={name!r}: baselines are PNG or EXR files; leave the suffix out, and glshade chooses")
    whole = name if own in SUFFIXES else name + suffix
    check_name(whole)
    return whole


def run_check(run: Run, request: Request, picture: Picture, name: str, folder: Path) -> str:
    """Compares a picture with its baseline, adds the case to the results, and updates the baseline if that was asked for.

    picture: the first picture that `request.draw` has given.
    name: the baseline's name with its suffix.
    folder: a temporary folder.
    Returns what is wrong; an empty text if the test passes. Errors: GlshadeError, OSError.
    """
    actual = folder / f"actual{Path(name).suffix.lower()}"
    picture.write(actual)
    if request.mask is not None:
        _check_mask(request.mask, actual)
    unstable = _unstable(run, request, picture, actual)
    origin = _origin(run, picture, actual)
    variants = run.baselines.variants(name, origin.driver)
    rule = request.rule or rule_of(variants)
    if variants:
        scenes = None
        # A rule that the test names judges in place of the scene.
        if request.rule is None:
            scenes = run.scene_judge() if picture.scene is None else SceneJudge(picture.scene)
        result = compare_variants(variants, actual, rule, name, scenes=scenes, mask=request.mask, origin=origin)
        # A reader does not know the temporary file.
        result = replace(result, reason=result.reason.replace(str(actual), "the test's picture"))
    else:
        result = Result(name, str(actual), Outcome.FILE, _no_baseline(run, name))
    if unstable:
        reason = "; ".join(filter(None, (unstable, result.reason)))
        result = replace(result, outcome=max(result.outcome, Outcome.FAIL), reason=reason)
    case = case_of(
        result, id=request.node_id, name=name, root=run.settings.baselines, rule=rule, origin=origin, missing=not variants
    )
    pictures = _pictures(result, actual, request.mask, folder)
    case = run.writer.add(case, pictures)
    refusal = ""
    if not unstable and _is_updated(run.settings.update, case):
        refusal = _update(run, case, pictures)
        if not refusal:
            return ""
    failure = "" if case.passed else messages.failure(run.settings, case, result)
    return "\n".join(filter(None, (failure, refusal)))


def _check_mask(mask: NDArray[np.bool_], picture: Path) -> None:
    """Checks that a mask has the size of a picture. Errors: GlshadeError."""
    width, height = parts(picture)[0].size
    if mask.shape != (height, width):
        raise GlshadeError(f"mask= has {mask.shape[1]}x{mask.shape[0]} pixels, and the picture has {width}x{height}")


def _unstable(run: Run, request: Request, picture: Picture, first: Path) -> str:
    """Returns what differs between several drawings of a picture, as --glshade-stability asks; empty if nothing does."""
    if run.settings.stability > 1 and request.ready_made and picture.scene is None:
        run.counts.ready_made += 1
        return ""
    for number in range(2, run.settings.stability + 1):
        again = first.with_stem(f"again{number}")
        (picture if request.ready_made else take(request.draw(), run.renderer, request.overrides)).write(again)
        if filecmp.cmp(first, again, shallow=False):
            continue
        result = compare_files(first, again, Exact(), name=again.name, mask=request.mask)
        if result.outcome:
            differing = [layer for layer in result.layers if layer.finding.outcome]
            named = [f"{layer.name or 'the colours'} ({layer.finding.reason})" for layer in differing]
            return (
                f"not deterministic: drawing {number} of {run.settings.stability} differs from the first one in "
                f"{', '.join(named) or result.reason}"
            )
    return ""


def _origin(run: Run, picture: Picture, actual: Path) -> Origin:
    """Returns who made the test picture, and from what. Errors: GlshadeError, OSError."""
    if picture.scene is None:
        return origin_of(actual)
    return drawn_by(run.renderer(), picture.scene, picture.scene_file, picture.overrides)


def _no_baseline(run: Run, name: str) -> str:
    """Returns the reason of a check without a baseline."""
    other = PurePosixPath(name).with_suffix(".png" if name.lower().endswith(".exr") else ".exr").as_posix()
    reason = f"{run.settings.baselines} does not hold {name}"
    if run.baselines.variants(other):
        return f"{reason}, but it holds {other}; to compare with that one, give name={other!r}"
    return reason


def _pictures(result: Result, actual: Path, mask: NDArray[np.bool_] | None, folder: Path) -> dict[str, Path]:
    """Returns the pictures of a case for the results. Errors: GlshadeError, OSError."""
    pictures = {"actual": actual}
    if result.baseline:
        pictures["expected"] = Path(result.baseline)
    masked = None if mask is None else np.where(mask, np.uint8(255), np.uint8(0))
    for kind, pixels in (("mask", masked), ("classes", result.classes)):
        if pixels is not None:
            pictures[kind] = folder / f"{kind}.png"
            from_array(pixels).write(pictures[kind])
    return pictures


def _is_updated(update: str, case: Case) -> bool:
    """Returns whether --glshade-update asks for a new baseline."""
    if update == "none" or (update == "missing" and not case.missing):
        return False
    return update == "all" or not case.passed


def _update(run: Run, case: Case, pictures: dict[str, Path]) -> str:
    """Makes the test picture the baseline. Returns why that is refused; empty if it is done. Errors: GlshadeError."""
    from glshade.golden.approval import approve

    settings = run.settings
    # A new baseline needs a main picture before it can have variants.
    as_variant = settings.update == "variant" and not case.missing
    try:
        done = approve(settings.results, [case], root=settings.baselines, as_variant=as_variant)
    except GlshadeError as error:
        # The lines that follow explain the command `glshade approve`.
        return f"--glshade-update {settings.update}: {str(error).splitlines()[0]}"
    run.counts.written += [approval.path for approval in done if approval.what != "unchanged"]
    # Of two lines about the same case, the later one counts.
    note = f"--glshade-update {settings.update} has made this picture the baseline"
    run.writer.add(case.model_copy(update={"outcome": "same", "missing": False, "notes": (*case.notes, note)}), pictures)
    return ""
