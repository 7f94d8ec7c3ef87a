"""Life: works in which people who render wait: new textures, moving meshes, many objects, large files, start-up.

Each module of this folder is found by its presence. It holds WORKS, a table of its works, and a class for each program that
does them. A new file adds works, and no list names it; the works' names must differ from those of all other works.
"""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, Literal, Protocol

from numpy.typing import NDArray

from glshade.bench.works import GLSHADE


class Program(Protocol):
    """A program that does a work of the kind "again", "first" or "process", in a process of its own.

    driver: name of its driver; None if unknown
    """

    driver: str | None

    def __init__(self, size: int, folder: Path) -> None:
        """Imports what the program needs. size, folder: as in LifeWork.set_up."""

    def prepare(self, number: int) -> Any:
        """Returns what the picture `number` is to show: its camera, its texture or its vertices. This is not timed."""

    def draw(self, prepared: Any) -> NDArray[Any]:
        """Returns the picture (H, W, 3 or 4) uint8, row 0 at the top, or several pictures (N, H, W, 3 or 4). This is timed."""


class Command(Protocol):
    """A program of the kind "process" that is a command of its own."""

    @staticmethod
    def command(size: int, folder: Path, picture: Path) -> list[str]:
        """Returns the command line, which writes the picture to the PNG file `picture` or makes none."""


@dataclass(frozen=True)
class LifeWork:
    """One work.

    what: description for the table's title
    kind: "again" draws one picture after another in one process, each with something new; "first" draws one picture in a new
        process, without the time of its imports; "process" is a whole process
    size: number of texels, objects, points or triangles, as the work's module defines it
    small: the size for a quick test, whose times are not comparable
    programs: name -> the class of a program, GLSHADE first
    targets: as in `works.Work`
    limit: largest time of glshade [s]; None if there is no limit
    over: name of the program whose time is subtracted from glshade's before it is compared with the limit; None for no program
    memory: largest memory of glshade [bytes]; None if there is no limit
    rounds: largest number of rounds that are counted
    warm: number of rounds before them
    on_request: whether the work is left out unless it is named, because it takes long
    set_up: writes the files of the work to a folder, of the size that it is given; None if the work has none
    """

    what: str
    kind: Literal["again", "first", "process"]
    size: int
    small: int
    programs: Mapping[str, type[Any]]
    targets: Mapping[str, float] = field(default_factory=dict)
    limit: float | None = None
    over: str | None = None
    memory: int | None = None
    rounds: int = 1000
    warm: int = 1
    on_request: bool = False
    set_up: Callable[[int, Path], None] | None = None


def _modules() -> list[str]:
    return sorted(path.stem for path in Path(__file__).parent.glob("*.py") if not path.stem.startswith("_"))


@cache
def homes() -> dict[str, str]:
    """Returns name of a work -> the module that holds it, in the order of the numbers in the works' names.

    Errors: ValueError if two modules have works of the same name.
    """
    found: dict[str, str] = {}
    for module in _modules():
        for name in importlib.import_module(f"{__name__}.{module}").WORKS:
            if name in found:
                raise ValueError(f"{module}.py and {found[name]}.py both have a work {name}")
            found[name] = module
    return dict(sorted(found.items(), key=lambda item: (item[0].rstrip("0123456789"), _number(item[0]))))


def _number(name: str) -> int:
    digits = "".join(letter for letter in name if letter.isdigit())
    return int(digits or 0)


def work(name: str) -> LifeWork:
    """Returns a work. Errors: KeyError for an unknown name."""
    found: LifeWork = importlib.import_module(f"{__name__}.{homes()[name]}").WORKS[name]
    return found


def installed(programs: Mapping[str, type[Any]]) -> list[str]:
    """Returns the names of the programs that can run here, without GLSHADE. No library is imported.

    The first word of a program's name is the library that it needs, or "python" for the bare interpreter.
    """
    libraries = {name: name.split()[0] for name in programs if name != GLSHADE}
    return [name for name, library in libraries.items() if library == "python" or importlib.util.find_spec(library)]
