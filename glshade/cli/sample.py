"""Command `glshade sample`: prints the scene that a sample stands for."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import click

from glshade.cli._options import limits, models, overrides
from glshade.limits import Limits


@click.command()
@click.argument("scene", type=click.Path(path_type=Path))
@click.option("-f", "--frame", type=int, default=1, show_default=True, help="Number of the sample, and of the frame.")
@click.option("--values", is_flag=True, help="Prints only the values that are drawn, by their dotted keys.")
@limits
@overrides
@models
def command(
    scene: Path, frame: int, values: bool, limits: Limits, overrides: list[tuple[str, str]], models: tuple[str, ...]
) -> None:
    """Prints the scene that sample N of SCENE stands for, as JSON that `glshade render` draws.

    The values of its table `sample` are drawn, and its animation is applied. Paths become absolute.
    """
    import json

    from glshade.errors import SceneError
    from glshade.scene.file import SceneFile
    from glshade.scene.models import use_models

    use_models(models)
    file = SceneFile(scene, overrides, limits)
    if not (drawn := file.drawn(frame)):
        raise SceneError(f"{scene}: has no table `sample` with values to draw")
    file.scene(frame)
    document = drawn if values else _placed(file.document_at(frame), scene.parent.absolute())
    if not values:
        # An animation is applied once, and what was drawn is not drawn again.
        document = {key: value for key, value in document.items() if key not in ("sample", "animation")}
    click.echo(json.dumps(document, indent=2))


# The keys whose texts are paths of files.
_PATHS = frozenset({"mesh", "texture", "ocio", "cameras_from"})


def _placed(value: Any, folder: Path) -> Any:
    """Returns a part of a document whose paths are absolute, and that leaves out keys without a value."""
    if isinstance(value, dict):
        kept = {key: item for key, item in value.items() if item is not None}
        return {key: _path(item, folder) if key in _PATHS else _placed(item, folder) for key, item in kept.items()}
    return [_placed(item, folder) for item in value] if isinstance(value, list | tuple) else value


def _path(value: Any, folder: Path) -> Any:
    """Returns a path as an absolute one. A name such as ocio://default is no path."""
    return os.path.join(folder, value) if isinstance(value, str) and "://" not in value else value
