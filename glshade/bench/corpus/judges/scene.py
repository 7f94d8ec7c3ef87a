"""scene: `glshade compare --scene`, which judges by what the float64 reference allows."""

from __future__ import annotations

from pathlib import Path

from glshade.bench.corpus.judges import Judge, Judgement, Pair
from glshade.golden.judge import compare_files
from glshade.golden.report import why
from glshade.golden.result import Outcome
from glshade.golden.rules import RULES
from glshade.golden.scene_judge import SceneJudge


class Scene(Judge):
    """glshade with the scene, without the search for causes, which takes most of the time.

    The candidates of one scene are kept at a time, because pairs come scene by scene.
    """

    title = "glshade with scene"

    def __init__(self) -> None:
        self._scene: Path | None = None
        self._judge: SceneJudge | None = None

    def judge(self, pair: Pair) -> Judgement:
        if pair.scene != self._scene:
            self._scene, self._judge = pair.scene, SceneJudge(pair.scene, explain=False)
        result = compare_files(pair.reference, pair.test, RULES["codes"](), scenes=self._judge)
        return Judgement(result.outcome is not Outcome.SAME, float(result.outcome), why(result))
