"""Reading: the parts that the readers of camera formats share. They refuse numbers that no camera has."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from glshade.arrays import Float64
from glshade.calibration.calibration import Calibration
from glshade.calibration.rotation import pose_of
from glshade.errors import AssetError
from glshade.files import read_text
from glshade.limits import LARGEST_CAMERAS

# The longest side of a picture that a camera may describe [pixels]. Whether it can be drawn is decided later, by the film.
MOST_PIXELS = 1_000_000

# Reading this many cameras takes ten seconds. A file of more is refused before they are understood.
MOST_CAMERAS = 100_000


class Fault(ValueError):
    """What is wrong with a part of a file, in words for its reader, without the place."""


@contextmanager
def at(path: Path, name: object) -> Iterator[None]:
    """Turns the faults of one camera into an AssetError that names the file and the camera."""
    try:
        yield
    except KeyError as error:
        raise AssetError(f"{path}: {name}: {error} is missing") from None
    except Fault as error:
        raise AssetError(f"{path}: {name}: {error}") from None


def text(path: Path) -> str:
    """Returns the text of a file. Errors: AssetError."""
    return read_text(path, LARGEST_CAMERAS, AssetError)


def table(path: Path) -> dict[str, Any]:
    """Returns the table in a JSON file. Errors: AssetError."""
    try:
        data = json.loads(text(path))
    except json.JSONDecodeError as error:
        raise AssetError(f"{path}: is not JSON: the fault is in line {error.lineno}, column {error.colno}") from None
    except RecursionError:
        raise AssetError(f"{path}: its tables and lists are nested too deeply to be read") from None
    except ValueError:
        # Python refuses whole numbers of more than 4300 digits.
        raise AssetError(f"{path}: holds a whole number of thousands of digits") from None
    if not isinstance(data, dict):
        raise AssetError(f"{path}: is not a table of cameras")
    return data


def rows(data: Mapping[str, Any], key: str, path: Path) -> list[dict[str, Any]]:
    """Returns a list of tables that a table holds. Errors: AssetError."""
    found = data[key]
    if not isinstance(found, list) or not all(isinstance(row, dict) for row in found):
        raise AssetError(f'{path}: "{key}" must be a list of tables, one for each picture')
    check_count(len(found), path)
    return found


def check_count(count: int, path: Path) -> None:
    """Refuses a file of too many cameras. Errors: AssetError."""
    if count > MOST_CAMERAS:
        raise AssetError(f"{path}: holds {count:,} cameras; {MOST_CAMERAS:,} can be read, so divide the file")


def number(value: Any, key: str) -> float:
    """Returns a finite number. Errors: Fault."""
    try:
        read = float(value)
    except (TypeError, ValueError, OverflowError):
        read = math.nan
    if not math.isfinite(read):
        raise Fault(f"{key} must be a finite number, not {str(value)[:40]}")
    return read


def numbers(value: Any, shape: tuple[int, ...], key: str) -> Float64:
    """Returns an array of finite numbers, whatever the lists that hold them are nested in. Errors: Fault."""
    try:
        read = np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        read = np.array(math.nan)
    if read.size != math.prod(shape) or not np.isfinite(read).all():
        raise Fault(f"{key} must be {math.prod(shape)} finite numbers")
    return read.reshape(shape)


def pixels(value: Any, key: str) -> int:
    """Returns the length of a side of a picture. Errors: Fault."""
    read = number(value, key)
    if read != int(read) or not 1 <= read <= MOST_PIXELS:
        raise Fault(f"{key} must be a whole number from 1 to {MOST_PIXELS}, not {str(value)[:40]}")
    return int(read)


def pose(rotation: Any, translation: Any, path: Path, name: str) -> Float64:
    """Returns the pose (4, 4) with a rotation of 9 numbers and a translation of 3.

    Errors: Fault for other numbers, and for a matrix that mirrors or flattens space.
    """
    turned, moved = numbers(rotation, (3, 3), "the rotation"), numbers(translation, (3,), "the translation")
    try:
        return pose_of(turned, moved, f"{path}: {name}")
    except ValueError as error:
        raise Fault(f"the rotation is none: {error}") from None


def pinhole(matrix: Any, key: str) -> tuple[float, float, float, float]:
    """Returns fx, fy, cx and cy of a camera matrix of 9 numbers. Errors: Fault for one that is skewed."""
    (fx, skew, cx), (other, fy, cy), last = numbers(matrix, (3, 3), key)
    # A skew that moves no pixel by 1e-6 of the focal length is a trace of rounding.
    if abs(skew) > 1e-6 * abs(fx) or other or last.tolist() != [0.0, 0.0, 1.0]:
        raise Fault(f"{key} must be [fx, 0, cx, 0, fy, cy, 0, 0, 1]; a skewed camera cannot be drawn")
    return float(fx), float(fy), float(cx), float(cy)


def camera(
    kind: Any, size: tuple[Any, Any], intrinsics: Sequence[Any], pose: Float64, planes: Mapping[str, Any] = MappingProxyType({})
) -> Calibration:
    """Returns a camera that was read, without objects.

    size: width and height [pixels].
    intrinsics: fx, fy, cx, cy, as in Calibration.
    planes: a table that may hold the depths "near" and "far"; without them both are 0, and follow from the scene.
    Errors: Fault.
    """
    if kind not in ("perspective", "orthographic"):
        raise Fault(f"the type {str(kind)[:40]} cannot be drawn; perspective and orthographic can")
    width, height = pixels(size[0], "the width"), pixels(size[1], "the height")
    fx, fy, cx, cy = map(number, intrinsics, ("fx", "fy", "cx", "cy"))
    if fx <= 0 or fy <= 0:
        raise Fault("the focal lengths must be greater than 0")
    near, far = (0.0 if planes.get(key) is None else number(planes[key], key) for key in ("near", "far"))
    return Calibration(kind, (width, height), fx, fy, cx, cy, pose, near, far)
