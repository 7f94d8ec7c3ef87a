"""With a scene, `glshade compare` finds 99 % of the corpus's regressions, and at most 0.5 % of its noises are false alarms.

An input is a pair of the corpus of `glshade bench compare`. The drivers that script/drivers has unpacked make further noises.
The proof prints the pairs that are judged wrongly, and counts those beyond the shares that the claim allows. Both shares are
rounded up to whole pairs.
"""

from __future__ import annotations

import math
from pathlib import Path
from tempfile import TemporaryDirectory

from drivers import DRIVERS, FOLDER, mesa

from glshade.bench.corpus.judging import available, judged
from glshade.bench.corpus.kinds import Noise
from glshade.bench.corpus.making import Item, planned
from glshade.bench.corpus.noises import NOISES
from glshade.bench.corpus.table import FALSE_ALARMS, FOUND, Tally

if FOLDER.is_dir() and any(FOLDER.glob("mesa-*")):
    for _name, _driver in DRIVERS.items():
        if _driver.unpacked:
            _settings = {"backend": _driver.backend, **(_driver.environment or {}), **mesa()}
            NOISES[_name] = Noise(_name, f"The driver {_name} draws.", driver=_settings)
COUNT = len(planned())
JUDGE = "scene"


def prove(count: int, seed: int) -> int:
    """Judges `count` pairs, prints those that are judged wrongly, and returns the number of those beyond the allowed shares."""
    tally = Tally()
    with TemporaryDirectory() as folder:
        pairs = judged(Path(folder), planned(count, seed), available([JUDGE], print), seed, report=print)
        tally.judged = [pair for pair in pairs if not isinstance(pair, Item)]
    if not tally.judged:
        return 0
    for pair, judgement in tally.wrong(JUDGE):
        item, said = pair.item, judgement.text or "passed"
        print(f"{item.group}: {item.scene}, {item.kind} {item.strength}: {said}; {pair.far} pixels are far apart")
    row = tally.row(JUDGE)
    print(f"{row.found} of {row.regressions} regressions found, {row.alarms} false alarms at {row.noises} noises")
    missed, allowed = row.regressions - row.found, math.ceil((1 - FOUND / 100) * row.regressions)
    return max(0, missed - allowed) + max(0, row.alarms - math.ceil(FALSE_ALARMS / 100 * row.noises))
