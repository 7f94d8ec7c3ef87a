"""files: the first picture of a large mesh file, by commands and scripts that are measured from their start to their end."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from glshade.bench.entrants import RENDER
from glshade.bench.life import LifeWork
from glshade.bench.life._stage import Array, terrain
from glshade.bench.works import GLSHADE

FILE = "terrain.obj"
# The number of lines of the file that are formatted at once.
LINES = 100_000


def written(side: int, folder: Path) -> None:
    """Writes a terrain of side x side vertices as an OBJ file with normals."""
    positions, triangles = terrain(side)
    normals = positions * [0, 0, 0] + [0, 0, 1]
    numbers = np.repeat(triangles + 1, 2, axis=1)
    with (folder / FILE).open("w", encoding="ascii") as file:
        for rows, form in (
            (positions, "v %.6f %.6f %.6f\n"),
            (normals, "vn %.4f %.4f %.4f\n"),
            (numbers, "f %d//%d %d//%d %d//%d\n"),
        ):
            lines = (form % tuple(row) for row in rows.tolist())
            file.writelines(_batches(lines))


def _batches(lines: Iterator[str]) -> Iterator[str]:
    while batch := "".join(islice(lines, LINES)):
        yield batch


class Command:
    """glshade: `glshade render FILE`, whose cache is empty.

    environment: name of a variable that names a folder, which is new and empty in each round
    """

    environment: ClassVar[dict[str, str]] = {"XDG_CACHE_HOME": "cache"}

    @staticmethod
    def command(size: int, folder: Path, picture: Path) -> list[str]:
        return [*RENDER, str(folder / FILE), "-o", str(picture), "--size", "512x512"]


# What a script for f3d consists of. f3d has a command, too, but its Python package comes without it.
F3D = """\
import sys, f3d
engine = f3d.Engine.create(True)
engine.window.size = 512, 512
engine.options.update({"ui.axis": False, "render.grid.enable": False})
engine.scene.add(sys.argv[1])
engine.window.camera.reset_to_bounds()
engine.window.render_to_image().save(sys.argv[2])
"""


class F3d:
    """f3d: a script of its Python package, whose picture has another light."""

    @staticmethod
    def command(size: int, folder: Path, picture: Path) -> list[str]:
        return [sys.executable, "-c", F3D, str(folder / FILE), str(picture)]


class Vtk:
    """VTK: vtkOBJReader."""

    driver: str | None = None

    def __init__(self, size: int, folder: Path) -> None:
        self._path = folder / FILE

    def prepare(self, number: int) -> Any:
        return None

    def draw(self, prepared: Any) -> Array:
        from glshade.bench.life._vtk import Window, vtk
        from glshade.bench.peers.vtk import coat

        reader, mapper, actor = vtk.vtkOBJReader(), vtk.vtkPolyDataMapper(), vtk.vtkActor()
        reader.SetFileName(str(self._path))
        mapper.SetInputConnection(reader.GetOutputPort())
        actor.SetMapper(mapper)
        coat(actor.GetProperty())
        window = Window((512, 512))
        window.add(actor)
        pixels = window.draw()
        self.driver = window.driver
        return pixels


WORKS = {
    "W18": LifeWork(
        "an OBJ file of 280 MB to a PNG file, from the start of the process to its end",
        "process",
        # Width and height of the terrain [vertices].
        size=1300,
        small=9,
        programs={GLSHADE: Command, "f3d": F3d, "vtk": Vtk},
        limit=20.0,
        memory=2_500_000_000,
        rounds=3,
        warm=0,
        set_up=written,
    )
}
