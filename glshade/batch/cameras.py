"""Cameras: writes a file that says how the pictures of a batch were seen, in a format of glshade/calibration."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from glshade.batch.task import Task
from glshade.calibration import file as camera_file
from glshade.calibration.calibration import CAMERA, CalibratedPicture, Calibration
from glshade.image import file as picture_file

if TYPE_CHECKING:
    from glshade.scene.scene import Scene


def check(path: Path, name: str, scenes: Mapping[str, Scene]) -> None:
    """Refuses, before pictures are drawn, a place where cameras cannot be written, and a format that cannot hold them.

    path, name: as for `write`.
    scenes: path of a picture -> its scene, for the pictures whose scenes are known already.
    Errors: GlshadeError.
    """
    flat = (output for output, scene in scenes.items() if not scene.camera.perspective)
    camera_file.check_kind(path, name, next(flat, None))
    camera_file.check_place(path, name)


def write(path: Path, name: str, tasks: Sequence[Task], calibrations: Mapping[int, Mapping[str, Any]]) -> list[str]:
    """Writes how the pictures that exist were seen, in the order of their tasks, and returns the pictures that are left out.

    A picture that was not drawn now, because it existed, tells its camera itself. A format that holds no texts cannot.

    path: the file or folder of cameras.
    name: the format, a key of `calibration.formats.FORMATS`.
    tasks: all pictures of the batch.
    calibrations: number of a task -> `Calibration.as_dict` of the picture that was drawn now.
    Errors: GlshadeError.
    """
    folder = os.path.abspath(path if camera_file.is_folder(name) else path.parent)
    pictures, missing = [], []
    for task in tasks:
        if not os.path.exists(task.output):
            continue
        found = calibrations.get(task.number) or _stored(task.output)
        if found is None:
            missing.append(task.output)
        else:
            relative = os.path.relpath(os.path.abspath(task.output), folder)
            pictures.append(CalibratedPicture(Path(relative).as_posix(), Calibration.from_dict(found)))
    camera_file.write(path, pictures, name)
    return missing


def _stored(path: str) -> Mapping[str, Any] | None:
    """Returns the calibration that a picture file stores; None where it stores none."""
    text = picture_file.attributes(path).get(CAMERA, "")
    try:
        data = json.loads(text)
        Calibration.from_dict(data)
    except (ValueError, KeyError, TypeError):
        return None
    stored: Mapping[str, Any] = data
    return stored
