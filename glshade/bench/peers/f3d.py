"""f3d: a peer that shows a mesh file, with its own light and its own grey material."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import f3d
import numpy as np
from numpy.typing import NDArray

from glshade.bench.stage import FOV, WorkFiles


class Peer:
    """Draws the work's PLY file without axes and grid, offscreen. f3d does not say which driver it uses."""

    driver = "VTK in f3d"

    def __init__(self, stage: WorkFiles) -> None:
        # Its messages about the progress of loading would cost time.
        f3d.Log.set_verbose_level(f3d.Log.VerboseLevel.QUIET)
        self._engine = f3d.Engine.create(True)
        self._engine.window.size = stage.side, stage.side
        hidden = {"ui.axis": False, "render.grid.enable": False, "render.background.color": [0.0, 0.0, 0.0]}
        self._engine.options.update(hidden)
        self._engine.scene.add(str(Path(stage.mesh).with_suffix(".ply")))

    def _render(self, eye: tuple[float, float, float]) -> Any:
        camera = self._engine.window.camera
        camera.position, camera.focal_point, camera.view_up, camera.view_angle = eye, (0, 0, 0), (0, 1, 0), FOV
        return self._engine.window.render_to_image()

    def frame(self, eye: tuple[float, float, float]) -> NDArray[Any]:
        image = self._render(eye)
        pixels = np.frombuffer(image.content, dtype=np.uint8)
        return pixels.reshape(image.height, image.width, image.channel_count)[::-1]

    def save(self, eye: tuple[float, float, float], path: str) -> None:
        self._render(eye).save(path)
