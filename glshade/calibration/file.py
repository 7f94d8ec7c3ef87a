"""File: reads and writes the cameras of pictures in any format of glshade/calibration/formats."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path, PurePosixPath

from glshade.calibration.calibration import CalibratedPicture, Calibration
from glshade.calibration.formats import FORMATS
from glshade.errors import AssetError, GlshadeError
from glshade.files import replacing


def write(path: Path, pictures: Sequence[CalibratedPicture], name: str) -> None:
    """Writes the cameras of pictures. Each file is written whole or not at all.

    path: the file, or the folder for the formats that write several files. A folder that is missing is made.
    name: the name of the format, a key of FORMATS.
    Errors: GlshadeError, also where the format cannot hold one of the cameras.
    """
    writer = FORMATS[name]()
    check_kind(path, name, next((picture.name for picture in pictures if picture.calibration.kind == "orthographic"), None))
    check_place(path, name)
    try:
        for part, text in writer.texts(pictures).items():
            with replacing(path / part if part else path) as temporary:
                temporary.write_text(text, encoding="utf-8")
    except OSError as error:
        raise GlshadeError(f"{path}: cannot be written: {error.strerror or error}") from None


def check_place(path: Path, name: str) -> None:
    """Makes the folder in which cameras will be written, and refuses a place where they cannot be.

    path, name: as for `write`.
    Errors: GlshadeError.
    """
    folder = path if is_folder(name) else path.parent
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise GlshadeError(f"{path}: the folder {folder} cannot be made: {error.strerror}") from None
    if folder != path and path.is_dir():
        raise GlshadeError(f"{path}: is a folder, but the format {name} is one file; name a file")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise GlshadeError(f"{path}: nothing can be written into the folder {folder}; change its permissions")


def check_kind(path: Path, name: str, orthographic: str | None) -> None:
    """Refuses an orthographic camera for a format that holds none.

    path, name: as for `write`.
    orthographic: the name of a picture or scene whose camera is orthographic; None without one.
    Errors: GlshadeError.
    """
    if orthographic is not None and not FORMATS[name].orthographic:
        others = " and ".join(other for other, known in FORMATS.items() if known.orthographic)
        raise GlshadeError(
            f"{path}: the format {name} holds no orthographic camera, such as that of {orthographic}; {others} do"
        )


def is_folder(name: str) -> bool:
    """Returns whether a format, a key of FORMATS, writes several files into a folder."""
    return FORMATS[name].folder


def usual_format(path: Path) -> str:
    """Returns the format that a path suggests: nerf for transforms.json, opencv for other .json files, else colmap."""
    if path.suffix.lower() != ".json":
        return "colmap"
    return "nerf" if path.name.lower().startswith("transforms") else "opencv"


def read(path: Path) -> list[CalibratedPicture]:
    """Returns the pictures, or the cameras, of a file or folder in any of the formats.

    Errors: AssetError, one line that starts with the path, where no format fits, or the file is broken.
    """
    if not os.path.exists(path):
        raise AssetError(f"{path}: there is no such file or folder")
    for name, format_class in FORMATS.items():
        reader = format_class()
        try:
            if not reader.recognises(path):
                continue
            found = reader.read(path)
        except KeyError as error:
            raise AssetError(f"{path}: is not a readable file of cameras in the format {name}: {error} is missing") from None
        except OSError as error:
            raise AssetError(f"{path}: cannot be read: {error.strerror or 'unknown fault'}") from None
        if not found:
            raise AssetError(f"{path}: holds no cameras")
        return found
    raise AssetError(f"{path}: holds no cameras in a format that is known: {', '.join(FORMATS)}")


def named(path: Path) -> dict[str, Calibration]:
    """Returns the cameras of a file or folder by their names: those of the pictures, without folder and suffix.

    Pictures of the same name in several folders keep their folders, and the suffix where only that differs.
    Errors: AssetError.
    """
    pictures = read(path)
    names = [PurePosixPath(picture.name.replace("\\", "/")) for picture in pictures]
    for short in (lambda name: name.stem, lambda name: str(name.with_suffix("")), str):
        found = {short(name): picture.calibration for name, picture in zip(names, pictures, strict=True)}
        if len(found) == len(pictures):
            return found
    raise AssetError(f"{path}: two pictures have the same name")
