"""Found: models by their presence. A module in the folder is a model; its name is the file's."""

from __future__ import annotations

import importlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Generic, TypeVar

Model = TypeVar("Model")


class Found(Mapping[str, type[Model]], Generic[Model]):
    """name -> class, for every module of a package. A class is imported when it is asked for: start-up time is a feature.

    The class of module `blinn_phong` is `BlinnPhong` plus `suffix`.
    """

    def __init__(self, package: str, folder: Path, suffix: str = "") -> None:
        self._package, self._suffix = package, suffix
        self._names = sorted(path.stem for path in folder.glob("*.py") if not path.stem.startswith("_"))
        self._classes: dict[str, type[Model]] = {}

    def class_name(self, name: str) -> str:
        """The class, and the GLSL struct, of the model `name`."""
        return "".join(word.capitalize() for word in name.split("_")) + self._suffix

    def __getitem__(self, name: str) -> type[Model]:
        if name not in self._classes:
            if name not in self._names:
                raise KeyError(name)
            module = importlib.import_module(f"{self._package}.{name}")
            self._classes[name] = getattr(module, self.class_name(name))
        return self._classes[name]

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)
