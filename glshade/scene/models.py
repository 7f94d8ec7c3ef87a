"""Models: the reflectance models and lights that users add in folders of their own, as files NAME.py and NAME.glsl."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

from glshade.brdfs import BRDFS, Brdf
from glshade.errors import SceneError
from glshade.files import check_regular, read_bytes
from glshade.lights import LIGHTS, Light
from glshade.limits import LARGEST_SHADER

# The package name that modules from the users' folders have in sys.modules.
PACKAGE = "glshade_models"

# One folder, or several.
Folders = str | Path | Iterable[str | Path]

# The folders whose models this process knows -> the digest of each folder's Python files at the time when they were run.
_folders: dict[Path, str] = {}


def model_folders() -> tuple[Path, ...]:
    """Returns the folders whose models this process knows, in the order in which they were added."""
    return tuple(_folders)


def models_digest() -> str:
    """Returns the SHA-256 of the Python files of all known folders as they were run. The folders' paths are not hashed."""
    return hashlib.sha256(" ".join(_folders.values()).encode()).hexdigest()


def use_models(folders: Folders | None) -> None:
    """Adds the models and lights of these folders to those that scenes may name. This runs the folders' Python files.

    NAME.py defines a class: a Brdf with the file's name in capitals (`shiny_thing.py`: ShinyThing), or a Light whose class name
    also ends in "Light" (`lamp.py`: LampLight). NAME.glsl beside it is its GLSL. Files whose names start with _ are not models;
    the models may import them. A folder that is known already is skipped.
    Errors: SceneError for a folder without models, a file that cannot be run, a class or a GLSL file that is missing, or a
    name that is taken.
    """
    for folder in paths(folders):
        if folder not in _folders:
            with _importable(folder):
                models = [_model(path) for path in _files(folder)]
            for name, model in models:
                if issubclass(model, Brdf):
                    BRDFS.add(name, model)
                else:
                    LIGHTS.add(name, model)
            _folders[folder] = _digest(folder)


def paths(folders: Folders | None) -> tuple[Path, ...]:
    """Returns the absolute paths of one folder, of several, or of none."""
    if folders is None:
        return ()
    listed = [folders] if isinstance(folders, str | Path) else folders
    return tuple(Path(os.path.abspath(folder)) for folder in listed)


def _files(folder: Path) -> list[Path]:
    """Returns the Python files of a folder's models. Errors: SceneError where there are none."""
    if not folder.is_dir():
        raise SceneError(f"{folder}: is not a folder")
    for path in folder.glob("*.py"):
        try:
            check_regular(path)
        except OSError as error:
            raise SceneError(f"{path}: cannot be read: {error.strerror}") from None
    files = sorted(path for path in folder.glob("*.py") if not path.stem.startswith("_"))
    if not files:
        raise SceneError(f"{folder}: has no models: a model is NAME.py with NAME.glsl beside it")
    return files


def _digest(folder: Path) -> str:
    """Returns the SHA-256 of a folder's Python files, those that start with _ included."""
    digest = hashlib.sha256()
    for path in sorted(folder.glob("*.py")):
        digest.update(f"\0{path.name}\0".encode() + read_bytes(path, LARGEST_SHADER))
    return digest.hexdigest()


def _model(path: Path) -> tuple[str, type[Any]]:
    """Returns the name and the class of the model in a file. Errors: SceneError, as `use_models`."""
    name = path.stem
    names = {BRDFS.class_name(name): Brdf, LIGHTS.class_name(name): Light}
    module = _run(path)
    model = next((getattr(module, known) for known in names if hasattr(module, known)), None)
    if not isinstance(model, type) or not issubclass(model, tuple(names.values())):
        brdf, light = names
        raise SceneError(f"{path}: defines neither a class {brdf} (a Brdf) nor a class {light} (a Light)")
    if not path.with_suffix(".glsl").is_file():
        raise SceneError(f"{path}: has no {name}.glsl beside it")
    taken = BRDFS if issubclass(model, Brdf) else LIGHTS
    if name in taken:
        raise SceneError(f'{path}: the name "{name}" is taken by another {"model" if taken is BRDFS else "light"}')
    return name, model


@contextmanager
def _importable(folder: Path) -> Iterator[None]:
    """Lets the files of a folder import each other. Afterwards their module names are free for the files of other folders."""
    before = set(sys.modules)
    sys.path.insert(0, str(folder))
    try:
        yield
    finally:
        sys.path.remove(str(folder))
        for name in {path.stem for path in folder.glob("*.py")} - before:
            sys.modules.pop(name, None)


def _run(path: Path) -> ModuleType:
    """Runs a file as a module, and returns the module. Errors: SceneError."""
    name = f"{PACKAGE}.{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    # pydantic looks up the annotations of a class in the module of this name.
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        del sys.modules[name]
        raise SceneError(f"{path}: cannot be run: {type(error).__name__}: {' '.join(str(error).split())}") from error
    return module
