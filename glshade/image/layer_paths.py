"""Layer paths: the formats and the names of the files in which the layers of a picture are stored."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Literal

# The layers that can be stored as PNG: those whose values have a natural range of codes.
PNG_AOVS = ("depth", "normal", "view_normal", "object_id", "material_id", "semantic_id", "mask")
LayerFormat = Literal["exr", "png"]


def layers_path(path: Path) -> Path:
    """Returns the path of the separate file that stores a picture's layers if the picture's format cannot store them."""
    return path.with_name(f"{path.stem}.aovs.exr")


def layer_files(path: Path, aovs: Iterable[str], form: LayerFormat) -> list[Path]:
    """Returns the separate files of a picture's layers, in the order in which they are written.

    path: the picture's file.
    aovs: the layers that the film asks for.
    form: the format of the layers.
    Errors: GlshadeError for a picture whose format is not known.
    """
    from glshade.image.file import format_of

    aovs = tuple(dict.fromkeys(aovs))
    if form == "png":
        return [*(png_path(path, aov) for aov in aovs), *([legend_path(path)] if aovs else [])]
    return [layers_path(path)] if aovs and not format_of(path).layers else []


def png_path(path: Path, layer: str) -> Path:
    """Returns the path of the PNG file of one of a picture's layers."""
    return path.with_name(f"{path.stem}.{layer}.png")


def legend_path(path: Path) -> Path:
    """Returns the path of the file that says what the codes of a picture's layers in PNG files mean."""
    return path.with_name(f"{path.stem}.aovs.json")
