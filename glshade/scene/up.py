"""Up: the axis of a bare mesh file that points up in its picture. The option `--up` and the override `up` name it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from glshade.errors import SceneError

if TYPE_CHECKING:
    from glshade.scene.override import Overrides

# The key of the override. It is none of the scene's keys: it chooses the transform of the only object.
KEY = "up"
# The rotations that turn an axis to y, as `transform.rotate` has them [degrees].
TURNS = {"x": (0.0, 0.0, 90.0), "y": (0.0, 0.0, 0.0), "z": (-90.0, 0.0, 0.0)}
CHOICES = (*TURNS, "auto")
# The axis that "auto" takes for a format, where it is not y. STL files say nothing, but they come from CAD programs and go to
# printers, whose beds lie in the plane of x and y. The readers of .dae and .3mf files turn the meshes to y themselves, as these
# formats say; glTF defines y. OBJ, PLY and OFF files have no convention that most programs follow, so they stay as they are.
CONVENTIONS = {".stl": "z"}


def turn(path: Path, overrides: Overrides) -> tuple[tuple[float, float, float], Overrides]:
    """Returns the rotation of a bare mesh [degrees], and the overrides without those of the key `up`.

    path: the mesh file. Errors: SceneError for a value that is no axis.
    """
    pairs = list(overrides.items() if hasattr(overrides, "items") else overrides)
    chosen = [value for key, value in pairs if key == KEY]
    axis = str(chosen[-1]) if chosen else "auto"
    if axis not in CHOICES:
        raise SceneError(f"{path}: up = {axis!r} is not an axis; known: {', '.join(CHOICES)}")
    if axis == "auto":
        axis = CONVENTIONS.get(path.suffix.lower(), "y")
    return TURNS[axis], [pair for pair in pairs if pair[0] != KEY] if chosen else overrides


def refuse(path: Path, overrides: Overrides) -> None:
    """Refuses the override `up` for a scene file. Errors: SceneError."""
    if any(key == KEY for key in overrides) or any(pair[0] == KEY for pair in overrides if isinstance(pair, tuple | list)):
        raise SceneError(f"{path}: --up is for mesh files; in a scene file, transform.rotate turns an object")
