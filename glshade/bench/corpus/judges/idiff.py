"""idiff: OpenImageIO's idiff with its defaults, by the function that the command calls."""

from __future__ import annotations

from typing import ClassVar

import OpenImageIO as oiio

from glshade.bench.corpus.judges import Judge, Judgement, Pair


class Idiff(Judge):
    """idiff. `fail` and `failpercent` are its options."""

    title = "idiff"
    fail: ClassVar[float] = 1e-6
    failpercent: ClassVar[float] = 0.0

    def judge(self, pair: Pair) -> Judgement:
        reference, test = (oiio.ImageBuf(str(path)) for path in (pair.reference, pair.test))
        found = oiio.ImageBufAlgo.compare(reference, test, self.fail, self.fail)
        share = 100 * found.nfail / (reference.spec().width * reference.spec().height)
        return Judgement(share > self.failpercent, share, f"{found.nfail} pixels, at most {found.maxerror:g}")
