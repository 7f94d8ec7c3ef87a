"""Table: counts how many regressions the judges find, and how many false alarms they give."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from glshade.bench.corpus.judges import JUDGES, Judgement
from glshade.bench.corpus.making import Item

# A regression counts if at least this many pixels differ by more than 2 codes. Weaker ones are listed apart, because a person
# would hardly see them.
PIXELS = 10
# Noise that changes a larger share of the pixels by more than one code is listed apart: it is another driver's picture rather
# than noise, and `glshade compare` asks whether it should be approved as a variant.
SHARE = 0.03
# The targets of glshade with the scene, in percent.
FOUND, FALSE_ALARMS = 99.0, 0.5


@dataclass(frozen=True)
class Judged:
    """A pair with what the judges say of it.

    item: the pair.
    far: the number of pixels that differ by more than 2 codes; a value that is NaN or infinite counts as PIXELS of them.
    moved: the share of the pixels that differ by more than 1 code.
    judgements: judge -> its judgement.
    """

    item: Item
    far: int
    moved: float
    judgements: dict[str, Judgement]

    @property
    def group(self) -> str:
        """The group in which the pair is counted: regressions, weak (regressions that hardly change the picture), noises, or
        variants (noises that change much of it).
        """
        if self.item.group == "regressions":
            return "weak" if self.far < PIXELS else "regressions"
        return "variants" if self.moved > SHARE else "noises"


@dataclass(frozen=True)
class Row:
    """What one judge found.

    title: the judge's title.
    found: the number of regressions that it flagged.
    regressions: the number of regressions.
    alarms: the number of noises that it flagged.
    noises: the number of noises.
    weak_found: the number of weak regressions that it flagged.
    weak: the number of weak regressions.
    variants_rejected: the number of variants that it flagged.
    variants: the number of variants.
    missed: kind of regression -> number of pairs that were not flagged.
    alarming: kind of noise -> number of pairs that were flagged.
    """

    title: str
    found: int
    regressions: int
    alarms: int
    noises: int
    weak_found: int
    weak: int
    variants_rejected: int
    variants: int
    missed: dict[str, int]
    alarming: dict[str, int]

    def cells(self) -> list[str]:
        """Returns the row's cells in a table with HEADS."""
        return [
            self.title,
            _percent(self.found, self.regressions),
            _percent(self.alarms, self.noises),
            _percent(self.weak_found, self.weak),
            _percent(self.variants_rejected, self.variants),
        ]


HEADS = ["judge", "regressions found", "false alarms", "weak regressions found", "variants rejected"]


@dataclass
class Tally:
    """All pairs that were judged.

    judged: the pairs.
    inapplicable: the number of pairs whose kind does not apply to their scene, or whose driver is not there.
    notes: lines about what could not be done.
    """

    judged: list[Judged] = field(default_factory=list)
    inapplicable: int = 0
    notes: list[str] = field(default_factory=list)

    @property
    def names(self) -> list[str]:
        """The judges that judged, in the order in which the first pair lists them."""
        return list(self.judged[0].judgements) if self.judged else []

    def flagged(self, name: str) -> list[bool]:
        """Returns for each pair whether a judge flagged it, with a threshold in hindsight where it has none."""
        threshold = self.threshold(name)
        judgements = [pair.judgements[name] for pair in self.judged]
        if JUDGES[name].threshold is not None or threshold is None:
            return [judgement.flagged for judgement in judgements]
        return [judgement.flagged or (judgement.value or 0.0) > threshold for judgement in judgements]

    def threshold(self, name: str) -> float | None:
        """Returns the threshold of a judge; None where it needs none because nothing was judged."""
        fixed = JUDGES[name].threshold
        if fixed is not None:
            return fixed
        values = [pair.judgements[name] for pair in self.judged if pair.group == "noises"]
        return best_threshold([math.inf if j.value is None else j.value for j in values])

    def row(self, name: str) -> Row:
        """Returns what a judge found."""
        flagged: dict[str, list[bool]] = {"regressions": [], "weak": [], "noises": [], "variants": []}
        missed: Counter[str] = Counter()
        alarming: Counter[str] = Counter()
        for pair, flag in zip(self.judged, self.flagged(name), strict=True):
            flagged[pair.group].append(flag)
            if pair.group == "regressions" and not flag:
                missed[pair.item.kind] += 1
            if pair.group == "noises" and flag:
                alarming[pair.item.kind] += 1
        title, threshold = JUDGES[name].title, self.threshold(name)
        if JUDGES[name].threshold is None and threshold is not None:
            title += f" > {threshold:.4f}"
        return Row(
            title,
            found=sum(flagged["regressions"]),
            regressions=len(flagged["regressions"]),
            alarms=sum(flagged["noises"]),
            noises=len(flagged["noises"]),
            weak_found=sum(flagged["weak"]),
            weak=len(flagged["weak"]),
            variants_rejected=sum(flagged["variants"]),
            variants=len(flagged["variants"]),
            missed=dict(missed.most_common()),
            alarming=dict(alarming.most_common()),
        )

    def rows(self) -> list[Row]:
        """Returns a row for each judge."""
        return [self.row(name) for name in self.names]

    def wrong(self, name: str) -> Iterator[tuple[Judged, Judgement]]:
        """Yields the pairs that a judge judged wrongly, except weak regressions and variants."""
        for pair, flag in zip(self.judged, self.flagged(name), strict=True):
            if pair.group in ("regressions", "noises") and flag != (pair.group == "regressions"):
                yield pair, pair.judgements[name]

    def as_dict(self) -> dict[str, Any]:
        """Returns the rows and all judgements as JSON types."""
        return {
            "inapplicable": self.inapplicable,
            "notes": self.notes,
            "target": {"found": FOUND, "false_alarms": FALSE_ALARMS},
            "judges": {name: vars(self.row(name)) for name in self.names},
            "pairs": [
                {
                    **vars(pair.item),
                    "counts_as": pair.group,
                    "far": pair.far,
                    "moved": pair.moved,
                    "judgements": {name: vars(judgement) for name, judgement in pair.judgements.items()},
                }
                for pair in self.judged
            ],
        }


def best_threshold(noises: Sequence[float], share: float = FALSE_ALARMS / 100) -> float | None:
    """Returns the smallest threshold above which at most a share of the values of noises lie; None without noises.

    A judge without a threshold of its own gets this one in hindsight, which is the best that a user could choose.
    """
    if not noises:
        return None
    ordered: list[float] = sorted(noises, reverse=True)
    return ordered[min(int(share * len(ordered)), len(ordered) - 1)]


def listed(counts: dict[str, int], most: int = 12) -> str:
    """Returns kinds with their counts in one line, at most `most` of them."""
    items: Iterable[tuple[str, int]] = list(counts.items())[:most]
    text = ", ".join(f"{kind} {count}" for kind, count in items)
    return f"{text}, ..." if len(counts) > most else text or "none"


def _percent(part: int, whole: int) -> str:
    """Returns a share in percent with its numbers; "-" where there is nothing to count."""
    return f"{100 * part / whole:.1f} % ({part} of {whole})" if whole else "-"
