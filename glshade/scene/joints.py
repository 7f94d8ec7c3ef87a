"""Joints: the values of a robot's joints. The option `--joint` and the overrides `joints.NAME` give them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from glshade.errors import SceneError, printable

if TYPE_CHECKING:
    from glshade.scene.override import Overrides

# The suffix of the files that have joints.
SUFFIX = ".urdf"
# The beginning of the keys of these overrides.
KEY = "joints."


def split(overrides: Overrides, path: Path) -> tuple[dict[str, float], Overrides]:
    """Returns the values of joints by their names, and the overrides without them.

    path: the robot's file, which messages name.
    Errors: SceneError for a value that is not a finite number.
    """
    pairs = list(overrides.items() if isinstance(overrides, Mapping) else overrides)
    values = {name_of(key): _number(value, name_of(key), path) for key, value in pairs if key.startswith(KEY)}
    return values, [pair for pair in pairs if not pair[0].startswith(KEY)]


def refuse(path: Path, overrides: Overrides) -> Overrides:
    """Returns the overrides of a file without joints. Errors: SceneError if one of them sets a joint."""
    pairs = list(overrides.items() if isinstance(overrides, Mapping) else overrides)
    if any(isinstance(pair, tuple | list) and str(pair[0]).startswith(KEY) for pair in pairs):
        raise SceneError(f"{path}: --joint is for robots ({SUFFIX} files); this file has no joints")
    return overrides if isinstance(overrides, Mapping) else pairs


def name_of(key: str) -> str:
    """Returns the joint's name in a key such as `joints.elbow` or `joints."left.elbow"`."""
    name = key.removeprefix(KEY).strip()
    return name[1:-1] if len(name) > 1 and name[0] == name[-1] and name[0] in "\"'" else name


def _number(value: Any, name: str, path: Path) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if isinstance(value, bool) or not math.isfinite(number):
        raise SceneError(f"{path}: --joint {printable(name[:100])}={printable(str(value)[:100])}: the value must be a number")
    return number
