"""verifying: the proof of a picture of thousands of objects. No other program does this."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from glshade.bench.life import LifeWork
from glshade.bench.life._stage import LIGHTS, MATERIAL, camera, grid, sphere
from glshade.bench.stage import write_ply
from glshade.bench.works import GLSHADE

FILE, MESH = "objects.json", "ball.ply"
# Number of subdivisions of each sphere, which has 80 triangles.
SUBDIVISIONS = 1


def written(count: int, folder: Path) -> None:
    """Writes a scene of spheres in a square, which share the mesh of one file."""
    write_ply(folder / MESH, *sphere(SUBDIVISIONS))
    places = [{"translate": place[:3], "scale": place[3]} for place in grid(count).tolist()]
    objects = [{"mesh": MESH, "material": MATERIAL, "transform": place} for place in places]
    film = {"size": [512, 512], "encoding": "linear"}
    text = json.dumps({"objects": objects, "lights": LIGHTS, "camera": camera(), "film": film})
    (folder / FILE).write_text(text, encoding="utf-8")


class Command:
    """glshade: `glshade verify`."""

    @staticmethod
    def command(size: int, folder: Path, picture: Path) -> list[str]:
        return [sys.executable, "-m", "glshade", "verify", str(folder / FILE)]


WORKS = {
    "W19": LifeWork(
        "`glshade verify` of 2,000 objects at 512x512",
        "process",
        size=2000,
        small=4,
        programs={GLSHADE: Command},
        limit=6.0,
        rounds=3,
        warm=0,
        set_up=written,
    )
}
