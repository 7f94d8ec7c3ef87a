"""startup: what glshade adds to the start of Python."""

from __future__ import annotations

import sys
from pathlib import Path

from glshade.bench.life import LifeWork
from glshade.bench.works import GLSHADE

# Name of the bare interpreter among the programs.
PYTHON = "python"


class Import:
    """glshade: `import glshade`."""

    @staticmethod
    def command(size: int, folder: Path, picture: Path) -> list[str]:
        return [sys.executable, "-c", "import glshade"]


class Help:
    """glshade: `glshade --help`."""

    @staticmethod
    def command(size: int, folder: Path, picture: Path) -> list[str]:
        return [sys.executable, "-m", "glshade", "--help"]


class Bare:
    """Python: a program that does nothing."""

    @staticmethod
    def command(size: int, folder: Path, picture: Path) -> list[str]:
        return [sys.executable, "-c", "pass"]


WORKS = {
    "W20": LifeWork("`import glshade`", "process", 1, 1, {GLSHADE: Import, PYTHON: Bare}, limit=0.015, over=PYTHON),
    "W21": LifeWork("`glshade --help`", "process", 1, 1, {GLSHADE: Help, PYTHON: Bare}, limit=0.060, over=PYTHON),
}
