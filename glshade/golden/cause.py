"""Causes: names the fault that explains why a picture is wrong, and says how much of the change it explains.

Faults of the whole picture are tried first, then those of the scene. A fault is named only if it explains nearly all of the
change, at the pixels that changed and at those that did not.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.golden.certainty import certain_pixels
from glshade.golden.change import ALIKE, ENOUGH, FEW, NAMED, Change, change_of
from glshade.golden.faults.coverage import covered, objects_moved
from glshade.golden.faults.falloffs import other_falloffs
from glshade.golden.faults.fitting import FEWEST, OBJECTS, Fitting, SceneFault
from glshade.golden.faults.searches import lights_moved, normals_turned, parameters
from glshade.golden.faults.shaders import mistakes
from glshade.golden.faults.strengths import scaled
from glshade.golden.result import Cause, Stage
from glshade.golden.surfaces import Surfaces, surfaces_at
from glshade.golden.whole_picture import best_fault
from glshade.scene.scene import Scene
from glshade.verification.candidates import Candidates, one_sample

Array = NDArray[Any]
Flags = NDArray[np.bool_]

# The sources of faults, in groups: a group is tried if those before it explain too little.
SOURCES = ((covered, scaled), (other_falloffs, mistakes), (parameters,), (normals_turned,), (lights_moved,), (objects_moved,))
# The search also goes on while less than this share of a considerable object's change is explained.
EACH = 0.97
# But a fault that leaves less than this share of what the simpler one leaves is the right one.
HARDLY = 0.1
# Faults of single objects, each with its own numbers, must explain this much more than one fault of all objects.
SIMPLER = 0.02


def scene_causes(scene: Scene, candidates: Candidates, truth: Array, test: Array, right: Array | None) -> tuple[Cause, ...]:
    """Returns the faults that explain why a picture of a scene is wrong; nothing where none does.

    candidates: the values that the reference allows.
    truth: (H, W, 3 or 4), the reference's picture in the unit of the test picture's file.
    test: (H, W, 3 or 4) uint8 or float32, finite.
    right: (H, W, 3 or 4), optional; a picture that the reference allows, such as the baseline. The errors of its driver are
        taken from the test picture, too, before a fault is fitted.
    """
    alpha = test.shape[2] == 4
    basis = truth if right is None else right
    whole_change = change_of(basis, test, alpha, _changed(basis, test))
    count = round(float(whole_change.weight[whole_change.amount > 0].sum()))
    if count <= FEW:
        return ()
    whole = best_fault(whole_change)
    if whole is not None and whole.explained >= ENOUGH:
        return (replace(whole, pixels=count),)
    cleaned = test
    if right is not None and test.dtype != np.uint8:
        cleaned = (truth + (test - right.astype(np.float64))).astype(np.float32)
    found = _of_scene(scene, candidates, truth, cleaned, alpha)
    share = sum(cause.explained * cause.pixels for cause in found) / max(sum(cause.pixels for cause in found), 1)
    if whole is not None and whole.explained > share + ALIKE:
        return (replace(whole, pixels=count),)
    # A cause alone counts all changed pixels, also those that are not certain and took no part in the search.
    return (replace(found[0], pixels=count),) if len(found) == 1 else found


def _changed(truth: Array, test: Array) -> Flags:
    """Returns which pixels (H, W) differ by more than a code, or in a picture of floats at all."""
    difference = np.abs(truth.astype(np.float64) - test).max(axis=2)
    return np.asarray(difference > (1 if test.dtype == np.uint8 else 0))


def _of_scene(scene: Scene, candidates: Candidates, truth: Array, test: Array, alpha: bool) -> tuple[Cause, ...]:
    """Returns the causes that lie in the scene, as in `scene_causes`."""
    certain = certain_pixels(candidates.expected).reshape(test.shape[:2])
    if alpha:
        # Where the background shines through, the colours of a file depend on its kind of alpha.
        certain &= candidates.picture[..., 3] == 1
    truth, test = truth[..., :3], test[..., :3]
    change = change_of(truth, test, False, _changed(truth, test) & certain, certain)
    true = candidates.picture.reshape(-1, 4)[change.pixel, :3]
    surfaces = surfaces_at(one_sample(scene), change.pixel, true)
    counts = ~surfaces.layered
    if not change.amount[counts].any():
        return ()
    fitting = Fitting(change, surfaces, counts, _largest(change, surfaces))
    scored: list[_Scored] = []
    causes: tuple[Cause, ...] = ()
    with np.errstate(all="ignore"):
        for group in SOURCES:
            scored += [_scored(fitting, fault) for source in group for fault in source(fitting)]
            causes, share, explained = _chosen(fitting, scored)
            if share >= ENOUGH:
                break
            fitting = replace(fitting, explained=explained)
    return causes


@dataclass(frozen=True, eq=False)
class _Scored:
    """A fault, and what it explains.

    share: the share of the whole change.
    shares: (D,), the share of each draw's change; NaN for a draw without change.
    left: the number of pixels of the sample that it leaves unexplained.
    """

    fault: SceneFault
    share: float
    shares: Array
    left: int

    def beats(self, other: _Scored | None, draw: int = -1) -> bool:
        """Returns whether it is better than a simpler fault, for one draw or for the whole change.

        It explains more, or leaves hardly anything of what the other one leaves.
        """
        share = self.share if draw < 0 else self.shares[draw]
        if other is None or not share >= NAMED:
            return bool(share >= NAMED)
        before = other.share if draw < 0 else other.shares[draw]
        cleaner = draw < 0 and other.left >= FEWEST and 1 - share < HARDLY * (1 - before)
        return bool(share > before + ALIKE or cleaner)


def _scored(fitting: Fitting, fault: SceneFault) -> _Scored:
    """Returns a fault with what it explains."""
    change, drawn = fitting.change, fitting.surfaces.object
    left = np.where(fitting.counts, change.left(change.with_alpha(change.stored(fault.light))), 0.0)
    amount = np.where(fitting.counts, change.amount, 0.0)
    number = len(fitting.surfaces.inputs.draws)
    seen = drawn >= 0
    lefts, amounts = (np.bincount(drawn[seen], values[seen], minlength=number) for values in (left, amount))
    return _Scored(fault, 1 - float(left.sum()) / float(amount.sum()), 1 - lefts / amounts, int(np.count_nonzero(left)))


def _largest(change: Change, surfaces: Surfaces) -> tuple[int, ...]:
    """Returns the indices of the draws whose pixels changed most, the largest change first."""
    drawn = surfaces.object >= 0
    amounts = np.bincount(surfaces.object[drawn], change.amount[drawn], minlength=len(surfaces.inputs.draws))
    order = np.argsort(-amounts, kind="stable")
    return tuple(int(draw) for draw in order[:OBJECTS] if amounts[draw] > 0)


def _chosen(fitting: Fitting, scored: Sequence[_Scored]) -> tuple[tuple[Cause, ...], float, frozenset[int]]:
    """Returns the causes that explain the change best, the share of it that they explain, and the draws that are explained."""
    # A fault of the whole scene, or of all objects alike.
    whole: _Scored | None = None
    for item in scored:
        if (item.fault.whole or not item.fault.alone) and item.beats(whole):
            whole = item
    # Faults of single objects.
    single: dict[int, _Scored] = {}
    for draw in fitting.objects:
        for item in scored:
            if item.fault.alone and item.fault.only in (-1, draw) and item.beats(single.get(draw), draw):
                single[draw] = item
    amounts = {draw: float(fitting.change.amount[fitting.of(draw)].sum()) for draw in fitting.objects}
    total = float(fitting.change.amount[fitting.counts].sum())
    together = sum(item.shares[draw] * amounts[draw] for draw, item in single.items()) / total
    if whole is not None and not _better_apart(fitting, whole, single, together):
        cause = _named(fitting, whole.fault, whole.share, fitting.objects, every=True)
        # The search goes on if an object with a small part of the change is not explained.
        lacking = any(whole.shares[draw] < EACH for draw in fitting.considerable)
        sure = frozenset(draw for draw in fitting.objects if whole.shares[draw] >= ENOUGH)
        return (cause,), min(whole.share, NAMED) if lacking else whole.share, sure
    # Objects with the same fault share one cause.
    by_text: dict[str, list[int]] = {}
    for draw, item in single.items():
        by_text.setdefault(item.fault.text, []).append(draw)
    causes = []
    for draws in by_text.values():
        share = sum(single[draw].shares[draw] * amounts[draw] for draw in draws) / sum(amounts[draw] for draw in draws)
        causes.append(_named(fitting, single[draws[0]].fault, share, tuple(draws), every=False))
    open_ = [draw for draw in fitting.considerable if draw not in single]
    if causes and open_:
        unknown = SceneFault("unknown", "shading of {objects}, for no known reason", "shading", fitting.surfaces.light)
        causes.append(_named(fitting, unknown, 0.0, tuple(open_), every=False))
    return tuple(causes), min(together, NAMED) if open_ else together, _sure(single)


def _better_apart(fitting: Fitting, whole: _Scored, single: Mapping[int, _Scored], together: float) -> bool:
    """Returns whether faults of single objects are a better explanation than one of the whole scene.

    single: draw -> its fault. together: the share of the change that these explain.
    """
    if together > whole.share + SIMPLER:
        return True
    # An object with a small part of the change has a fault that the fault of the whole scene does not explain.
    overlooked = [draw for draw in fitting.considerable if whole.shares[draw] < NAMED]
    return bool(overlooked) and together >= whole.share - ALIKE and all(draw in single for draw in overlooked)


def _sure(single: Mapping[int, _Scored]) -> frozenset[int]:
    """Returns the draws whose own fault explains enough. single: draw -> its fault."""
    return frozenset(draw for draw, item in single.items() if item.shares[draw] >= ENOUGH)


def _named(fitting: Fitting, fault: SceneFault, share: float, draws: tuple[int, ...], every: bool) -> Cause:
    """Returns the cause of a fault.

    share: the share of the change that it explains.
    draws: the draws that show it, the one with the largest change first.
    every: whether the fault is one of the whole scene.
    """
    names = list(dict.fromkeys(fitting.surfaces.name(draw) for draw in draws))
    visible = set(np.unique(fitting.surfaces.object[fitting.surfaces.object >= 0]).tolist())
    everywhere = every and len(visible) > 1 and (visible <= set(draws) or len(draws) == OBJECTS)
    objects = "all objects" if everywhere else ", ".join(names)
    where = np.isin(fitting.surfaces.object, draws) if not every else np.ones(len(fitting.counts), dtype=np.bool_)
    pixels = float(fitting.change.weight[where & (fitting.change.amount > 0)].sum())
    stage: Stage = fault.stage
    text = fault.text.format(objects=objects, of="" if every else f" of {objects}")
    return Cause(fault.kind, text, names[0] if names else "", stage=stage, explained=share, pixels=round(pixels))
