"""Peers: programs other than glshade that draw the same works. Each module is one peer, named after the library that it needs.

Each module has a `class Peer`:

    __init__(stage)   opens the driver and uploads the scene, with the settings that draw this picture fastest
    frame(eye)        returns the picture (H, W, 3 or 4) uint8, row 0 at the top
    save(eye, path)   writes the picture to a PNG file, in the way that is usual for the library
    driver            name of the driver

Peers share no code with glshade except the numbers of the scene.
"""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any, Protocol

from numpy.typing import NDArray

from glshade.bench.works import BY_HAND

# Programs that show mesh files, with a light of their own. They take part where a work begins with a file.
VIEWERS = ("f3d",)
NAMES = tuple(sorted(path.stem for path in Path(__file__).parent.glob("*.py") if not path.stem.startswith("_")))


class PeerProgram(Protocol):
    """A program that draws a stage."""

    driver: str

    def frame(self, eye: tuple[float, float, float]) -> NDArray[Any]:
        """Returns the picture (H, W, 3 or 4) uint8, row 0 at the top, seen from `eye` towards the origin."""

    def save(self, eye: tuple[float, float, float], path: str) -> None:
        """Writes the picture to a PNG file."""


def installed() -> tuple[str, ...]:
    """Returns the names of the peers whose libraries are installed, BY_HAND first. No library is imported."""
    names = [name for name in NAMES if importlib.util.find_spec(name) is not None]
    return tuple(sorted(names, key=lambda name: (name != BY_HAND, name)))
