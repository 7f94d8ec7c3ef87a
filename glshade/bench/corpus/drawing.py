"""Drawing: draws scenes of the corpus as a user would, in this process or in one with another driver.

As a program, `python -m glshade.bench.corpus.drawing` reads from stdin {"backend": name, "pictures": [[scene, picture]]}.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from glshade.bench.corpus.case import driver_attributes, write_pixels
from glshade.errors import GlshadeError
from glshade.gl.preparation import ApproximateWarning
from glshade.scene.file import load

if TYPE_CHECKING:
    from glshade.gl.renderer import Renderer


def draw_file(renderer: Renderer, scene: Path, picture: Path) -> None:
    """Draws a scene file to a picture file, which names the driver. Errors: those of load, `Renderer.render` and write."""
    with warnings.catch_warnings():
        # Two scenes have blended surfaces, which no triangle cuts.
        warnings.simplefilter("ignore", ApproximateWarning)
        image = renderer.render(load(scene), dtype="float32" if picture.suffix == ".exr" else "uint8")
    write_pixels(picture, image.pixels, driver_attributes(renderer))


def draw_elsewhere(driver: Mapping[str, str], pictures: Sequence[tuple[Path, Path]]) -> str:
    """Draws pairs (scene file, picture file) in a process with another driver. Returns why it failed; empty if it did not.

    driver: as in `kinds.Noise`.
    """
    environment = {key: value for key, value in driver.items() if key != "backend"}
    orders = {"backend": driver["backend"], "pictures": [[str(scene), str(picture)] for scene, picture in pictures]}
    done = subprocess.run(
        [sys.executable, "-m", "glshade.bench.corpus.drawing"],
        input=json.dumps(orders),
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode == 0:
        return ""
    return (done.stderr.strip().splitlines() or [f"the process ended with the code {done.returncode}"])[-1]


def main() -> None:
    """Carries out the orders from stdin."""
    from glshade.gl.renderer import Renderer

    orders = json.load(sys.stdin)
    try:
        with Renderer(orders["backend"]) as renderer:
            for scene, picture in orders["pictures"]:
                draw_file(renderer, Path(scene), Path(picture))
    except GlshadeError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
