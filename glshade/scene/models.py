"""Models: the reflectance models and lights that users add in folders of their own, as files NAME.py and NAME.glsl.

A reflectance model may also be a file NAME.glsl alone, in such a folder or as brdf/NAME.glsl in a shader folder.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

from glshade.brdfs import BRDFS, Brdf
from glshade.errors import SceneError, ShaderError
from glshade.files import check_regular, read_bytes
from glshade.lights import LIGHTS, Light
from glshade.limits import LARGEST_SHADER
from glshade.scene.glsl_model import read_model

# The package name that modules from the users' folders have in sys.modules.
PACKAGE = "glshade_models"

# A module can be looked up by its name only if its package can, which pickle does.
sys.modules.setdefault(PACKAGE, ModuleType(PACKAGE))

# One folder, or several.
Folders = str | Path | Iterable[str | Path]

# The folders whose models this process knows -> the digest of each folder's Python files at the time when they were run.
_folders: dict[Path, str] = {}
# The GLSL files without a Python file beside them that may define a model -> (the text that was read last, whether it defines
# one).
_alone: dict[Path, tuple[bytes, bool]] = {}


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
    the models may import them. A NAME.glsl without a NAME.py is a reflectance model without a reference. A folder that is known
    already is skipped, except for such files: those that have changed are read again.
    Errors: SceneError for a folder without models, a file that cannot be run, a class or a GLSL file that is missing, or a
    name that is taken; ShaderError for a GLSL file alone whose struct cannot be understood.
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
            _folders[folder] = files_digest(folder)
    beside = [path for folder in _folders for path in sorted(folder.glob("*.glsl")) if not path.with_suffix(".py").exists()]
    _read_alone(dict.fromkeys([*beside, *(path for path in _alone if path.exists())]))


def use_shader_models(folders: Folders | None) -> None:
    """Adds the reflectance models that are files brdf/NAME.glsl of shader folders. Files that replace other models add none.

    Errors: ShaderError for a file whose struct cannot be understood.
    """
    for folder in paths(folders):
        _read_alone(sorted((folder / "brdf").glob("*.glsl")))


def _read_alone(files: Iterable[Path]) -> None:
    """Adds or replaces the models of GLSL files that have no Python file, where their text has changed.

    Errors: ShaderError with the faults of all files.
    """
    faults: list[str] = []
    for path in files:
        known = _alone.get(path)
        if path.stem.startswith("_") or (path.stem in BRDFS and not (known and known[1])):
            continue
        try:
            _add_alone(path, read_bytes(path, LARGEST_SHADER))
        except OSError as error:
            faults.append(f"{path}: cannot be read: {error.strerror}")
        except ShaderError as error:
            faults.append(str(error))
    if faults:
        raise ShaderError("\n".join(faults))


def _add_alone(path: Path, text: bytes) -> None:
    """Adds or replaces the model of a GLSL file, unless its text is known. Errors: ShaderError."""
    if path not in _alone or _alone[path][0] != text:
        model = read_model(path, text)
        _alone[path] = text, model is not None
        if model is not None:
            BRDFS.add(path.stem, model)


def glsl_models() -> dict[Path, bytes]:
    """Returns the files of all models without a reference that this process knows, each with its text."""
    return {path: text for path, (text, is_model) in _alone.items() if is_model}


def use_glsl_models(texts: Mapping[Path, bytes]) -> None:
    """Adds models without a reference, or replaces them, by their texts. Errors: ShaderError. texts: file -> its text."""
    for path, text in texts.items():
        _add_alone(path, text)


def are_stale(folders: Folders | None) -> bool:
    """Returns whether this process runs other models than these folders hold now. Only a new process can run changed files."""
    wanted = paths(folders)
    return any(folder not in wanted or files_digest(folder) != digest for folder, digest in _folders.items())


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
    if not files and not any(folder.glob("*.glsl")):
        raise SceneError(f"{folder}: has no models: a model is NAME.py with NAME.glsl beside it, or NAME.glsl alone")
    return files


def files_digest(folder: Path) -> str:
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
