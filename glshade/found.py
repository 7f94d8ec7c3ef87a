"""Found: tables of classes, one for each module of a package. A new file in the package adds a class to the table."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Generic, TypeVar

Model = TypeVar("Model")


class Found(Mapping[str, type[Model]], Generic[Model]):
    """A table from the names of a package's modules to the class that each module holds.

    The class of the module `blinn_phong` is named `BlinnPhong` with the table's suffix. A module is imported when its class is
    first asked for, which keeps start-up short. Modules whose names start with _ are left out.
    """

    def __init__(self, package: str, folder: Path, suffix: str = "") -> None:
        """package: the package's dotted name. folder: the folder of its modules. suffix: the end of every class name."""
        self._package, self._suffix = package, suffix
        self._names = sorted(path.stem for path in folder.glob("*.py") if not path.stem.startswith("_"))
        self._classes: dict[str, type[Model]] = {}

    def class_name(self, name: str) -> str:
        """Returns the name of the class of a module, which is also the name of the model's GLSL struct."""
        return "".join(word.capitalize() for word in name.split("_")) + self._suffix

    def __getitem__(self, name: str) -> type[Model]:
        if name not in self._classes:
            if name not in self._names:
                raise KeyError(name)
            module = importlib.import_module(f"{self._package}.{name}")
            self._classes[name] = getattr(module, self.class_name(name))
        return self._classes[name]

    def add(self, name: str, model: type[Model]) -> None:
        """Adds a class that lies outside the package, under a name of its own."""
        self._classes[name] = model
        self._names = sorted({*self._names, name})

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


def lazily(package: str, homes: Mapping[str, str]) -> Callable[[str], Any]:
    """Returns a `__getattr__` for a package, which imports a name from its module when it is first used.

    package: the package's dotted name.
    homes: public name -> the module of the package that holds it.
    """

    def __getattr__(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(importlib.import_module(f"{package}.{homes[name]}"), name)

    return __getattr__
