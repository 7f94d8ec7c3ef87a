"""Judging: makes the pairs of the corpus, and has every judge judge them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from glshade.bench.corpus.case import differing
from glshade.bench.corpus.judges import JUDGES, Judge, Pair
from glshade.bench.corpus.making import Item, Made, make
from glshade.bench.corpus.scenes import SIZE
from glshade.bench.corpus.table import Judged


def available(names: Iterable[str], report: Callable[[str], None]) -> dict[str, Judge]:
    """Returns the judges with these names that are installed. report: is called with a line about each that is not."""
    judges: dict[str, Judge] = {}
    for name in names:
        try:
            judges[name] = JUDGES[name]()
        except ImportError as error:
            report(f"{JUDGES[name].title if name in JUDGES else name}: left out: {error}; pip install 'glshade[peers]'")
    return judges


def judged(
    folder: Path,
    items: Iterable[Item],
    judges: dict[str, Judge],
    seed: int = 0,
    size: tuple[int, int] = SIZE,
    report: Callable[[str], None] = lambda text: None,
) -> Iterator[Judged | Item]:
    """Yields each pair with all judgements, and an Item for a pair that cannot be made. Arguments and errors as for `make`."""
    for made in make(folder, items, seed, size, report):
        yield made if isinstance(made, Item) else _judged(made, judges)


def _judged(made: Made, judges: dict[str, Judge]) -> Judged:
    pair = Pair(made.scene, made.reference, made.test)
    reference, test = pair.pixels
    moved = differing(reference, test, 1) / (reference.shape[0] * reference.shape[1])
    judgements = {name: judge.judge(pair) for name, judge in judges.items()}
    return Judged(made.item, differing(reference, test, 2), moved, judgements)
