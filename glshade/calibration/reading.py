"""Reading: the parts that the readers of camera formats share."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

from glshade.arrays import Float64
from glshade.calibration.calibration import Calibration
from glshade.errors import AssetError
from glshade.files import read_bytes
from glshade.limits import LARGEST_SCENE


def text(path: Path) -> str:
    """Returns the text of a file. Errors: AssetError."""
    try:
        return read_bytes(path, LARGEST_SCENE).decode("utf-8-sig")
    except FileNotFoundError:
        raise AssetError(f"{path}: there is no such file") from None
    except UnicodeDecodeError as error:
        raise AssetError(f"{path}: is not UTF-8 text (byte {error.start})") from None
    except OSError as error:
        raise AssetError(f"{path}: cannot be read: {error.strerror}") from None


def table(path: Path) -> dict[str, Any]:
    """Returns the table in a JSON file. Errors: AssetError."""
    try:
        data = json.loads(text(path))
    except (ValueError, RecursionError) as error:
        raise AssetError(f"{path}: is not JSON: {error}") from None
    if not isinstance(data, dict):
        raise AssetError(f"{path}: is not a table of cameras")
    return data


def camera(
    kind: Any, size: tuple[int, int], numbers: Sequence[float], pose: Float64, planes: Mapping[str, Any] = MappingProxyType({})
) -> Calibration:
    """Returns a camera that was read, without objects.

    numbers: fx, fy, cx, cy, as in Calibration.
    planes: a table that may hold the depths "near" and "far"; without them both are 0, and follow from the scene.
    """
    fx, fy, cx, cy = map(float, numbers)
    near, far = (float(planes.get(key, 0.0)) for key in ("near", "far"))
    return Calibration(kind, size, fx, fy, cx, cy, pose, near, far)
