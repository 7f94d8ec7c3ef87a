"""idiff_loose: idiff with thresholds of a common kind, which pass small differences: `--fail 0.2 --failpercent 1`."""

from glshade.bench.corpus.judges.idiff import Idiff


class IdiffLoose(Idiff):
    """idiff where 1 % of the pixels may differ by more than 0.2."""

    title = "idiff 0.2, 1 %"
    fail = 0.2
    failpercent = 1.0
