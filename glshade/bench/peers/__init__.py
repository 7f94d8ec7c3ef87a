"""Peers: other programs that draw the same work. A module here is a peer, named as the library that it needs.

Each has `class Peer`:

    __init__(stage)   opens, uploads and, where there is a choice, takes what is fastest at that picture
    frame(eye)        (H, W, 3 or 4) uint8, row 0 at the top
    save(eye, path)   the frame to a PNG file, as people who use the library write one
    driver            what draws

They share nothing with glshade but the numbers of the scene.
"""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any, Protocol

from numpy.typing import NDArray

from glshade.bench.works import BY_HAND

NAMES = tuple(sorted(path.stem for path in Path(__file__).parent.glob("*.py") if not path.stem.startswith("_")))


class Program(Protocol):
    """What draws a stage."""

    driver: str

    def frame(self, eye: tuple[float, float, float]) -> NDArray[Any]:
        """(H, W, 3 or 4) uint8, row 0 at the top."""

    def save(self, eye: tuple[float, float, float], path: str) -> None:
        """The frame, as a PNG file."""


def installed() -> tuple[str, ...]:
    """The peers whose libraries are there, the one written by hand first. None is imported."""
    found = [name for name in NAMES if importlib.util.find_spec(name) is not None]
    return tuple(sorted(found, key=lambda name: (name != BY_HAND, name)))
