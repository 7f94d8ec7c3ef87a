"""Own: glshade as a program of a contest, for works of the kind "frame". It renders the scene file as a user would."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from glshade.bench.stage import WorkFiles
from glshade.gl.renderer import Renderer
from glshade.scene.file import load


class Peer:
    """A Renderer that is kept open. Works that write files run `glshade render` instead; see `entrants.Files` and `Cold`."""

    def __init__(self, stage: WorkFiles) -> None:
        self._scene = load(stage.scene)
        self._renderer = Renderer()
        context = self._renderer.context
        self.driver = f"{context.renderer}; {context.version}"

    def frame(self, eye: tuple[float, float, float]) -> NDArray[Any]:
        """Returns the frame. `eye` is ignored: works of this kind always look from `stage.EYE`, where the scene's camera is."""
        return self._renderer.render(self._scene).pixels
