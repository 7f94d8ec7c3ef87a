"""Run: what the plugin keeps while tests run in one process: the writer of results, the OpenGL context, counts."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from glshade.errors import GlshadeError
from glshade.golden.baselines import Baselines
from glshade.golden.pytest_plugin.process import Process
from glshade.golden.results import ResultsWriter

if TYPE_CHECKING:
    from glshade.gl.renderer import Renderer
    from glshade.golden.scene_judge import SceneJudge


class Run:
    """The state of one process that has used the plugin.

    settings: the plugin's settings.
    baselines: the folder of the baselines.
    writer: writes the results of this process.
    counts: the numbers that this process tells at its end.
    """

    def __init__(self, process: Process, claims: Path) -> None:
        """claims: a folder that all processes of the run share, and that is empty when the run starts."""
        self.settings = process.settings
        self.counts = process.counts
        self.baselines = Baselines(self.settings.baselines)
        self.writer = ResultsWriter(self.settings.results, process.run, process.worker)
        self._users = process.users
        self._claims = claims
        self._renderer: Renderer | None = None
        self._judge: SceneJudge | None = None

    def renderer(self) -> Renderer:
        """Returns the process's Renderer, which opens its OpenGL context at the first call. Errors: ContextError."""
        if self._renderer is None:
            from glshade.gl.renderer import Renderer

            self._renderer = Renderer()
        return self._renderer

    def scene_judge(self) -> SceneJudge:
        """Returns the judge of pictures whose baselines' sidecars name their scenes. It keeps what it has computed."""
        if self._judge is None:
            from glshade.golden.scene_judge import SceneJudge

            self._judge = SceneJudge()
        return self._judge

    def claim(self, name: str, node_id: str) -> None:
        """Notes that a test uses a baseline. Errors: GlshadeError where another test of the run uses it, in any process."""
        self._users.add(node_id)
        self._claims.mkdir(exist_ok=True)
        path = self._claims / hashlib.sha256(name.encode()).hexdigest()
        try:
            # The file system decides which of two processes is first.
            with open(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY), "w", encoding="utf-8") as file:
                file.write(node_id)
        except FileExistsError:
            owner = path.read_text(encoding="utf-8")
            if owner != node_id:
                # The file is empty if its process has created it at this very moment.
                raise GlshadeError(
                    f"two tests use the baseline {name}: {owner or 'another one'} and {node_id}; give each of them a name= of "
                    "its own"
                ) from None

    def close(self) -> None:
        """Closes the OpenGL context."""
        if self._renderer is not None:
            self._renderer.release()
            self._renderer = None


def shared_folder(factory: pytest.TempPathFactory, process: Process) -> Path:
    """Returns the folder for the claims of all processes: pytest's temporary folder of this run.

    With pytest-xdist, the folder of a worker lies in that of the run.
    """
    base = factory.getbasetemp()
    return (base.parent if process.worker else base) / "glshade-claims"
