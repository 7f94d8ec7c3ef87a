"""Kinds: the regressions and the noises of the corpus. Each is a function, which a decorator adds to a table.

The name of a kind is the name of its function with "-" for "_", and its description is the function's docstring.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

from numpy.typing import NDArray

if TYPE_CHECKING:
    from pathlib import Path

    from glshade.bench.corpus.case import Case

Array = NDArray[Any]
# Returns the pixels of the test picture as `Case.baseline` holds its own, or None where the kind cannot apply to the scene.
Make: TypeAlias = "Callable[[Case, Any], Array | None]"
Function = TypeVar("Function", bound=Callable[..., Any])


@dataclass(frozen=True)
class Regression:
    """A kind of fault.

    name: its name.
    description: one sentence that says what is wrong.
    strengths: the strengths at which it is made, the strongest first.
    make: makes the test picture of a case, at one of the strengths.
    """

    name: str
    description: str
    strengths: tuple[Any, ...]
    make: Make


@dataclass(frozen=True)
class Noise:
    """A kind of difference that a right driver may make. One of `make`, `write` and `driver` makes it.

    name: its name.
    reason: sentences that say what differs, and why a right driver may do so.
    make: makes the pixels of the test picture; they are stored without the name of a driver.
    write: writes the file of the test picture itself.
    driver: the environment variables of a process that draws the scene; the key "backend" is glshade's backend.
    samples: the most samples per pixel of which the driver is capable; it does not draw scenes that ask for more.
    """

    name: str
    reason: str
    make: Callable[[Case], Array | None] | None = None
    write: Callable[[Case, Path], None] | None = None
    driver: Mapping[str, str] = field(default_factory=dict)
    samples: int = 16


REGRESSIONS: dict[str, Regression] = {}
NOISES: dict[str, Noise] = {}


def regression(*strengths: Any) -> Callable[[Function], Function]:
    """Returns a decorator that adds a function (case, strength) -> pixels to the regressions."""

    def add(function: Function) -> Function:
        name = _name(function)
        REGRESSIONS[name] = Regression(name, _sentences(function), strengths, function)
        return function

    return add


def noise(function: Function) -> Function:
    """Adds a function (case) -> pixels to the noises."""
    name = _name(function)
    NOISES[name] = Noise(name, _sentences(function), make=function)
    return function


def file_noise(function: Function) -> Function:
    """Adds a function (case, path) that writes the test picture to the noises."""
    name = _name(function)
    NOISES[name] = Noise(name, _sentences(function), write=function)
    return function


def _name(function: Callable[..., Any]) -> str:
    return function.__name__.replace("_", "-")


def _sentences(function: Callable[..., Any]) -> str:
    return " ".join((inspect.getdoc(function) or "").split())
