"""glshade's own part in the works that are drawn again and again: the scene file, loaded and rendered as anybody would."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

import glshade
from glshade.bench.stage import Stage


class Peer:
    """A Renderer that is kept. Its files are made by the command line, as a user makes them: see `contest`."""

    def __init__(self, stage: Stage) -> None:
        self._scene = glshade.load(stage.scene)
        self._renderer = glshade.Renderer()
        context = self._renderer.context
        self.driver = f"{context.renderer}; {context.version}"

    def frame(self, eye: tuple[float, float, float]) -> NDArray[Any]:
        """The scene's own camera stands at `stage.EYE`, where the works of this kind look from."""
        return self._renderer.render(self._scene).pixels
