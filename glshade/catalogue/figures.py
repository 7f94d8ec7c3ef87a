"""Plots: figures of materials, by matplotlib (`pip install 'glshade[plot]'`). The data behind them are in glshade/lobe.py.

`figure({"gold": material, ...}, kinds=["polar"])` gives a matplotlib Figure, `save(figure, path)` a file whose bytes are the
same whenever it is made.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from glshade.brdfs import Brdf
from glshade.catalogue.lobe import Quantity
from glshade.catalogue.pictures import DRAWN as DRAWN
from glshade.catalogue.pictures import KINDS as KINDS
from glshade.catalogue.pictures import PICTURES as PICTURES
from glshade.catalogue.pictures import Kind as Kind
from glshade.errors import GlshadeError, MissingLibrary
from glshade.files import replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from glshade.catalogue.sheet import Scale as Scale
    from glshade.gl.renderer import Renderer

SUFFIXES = (".pdf", ".png", ".svg")
ANGLES = tuple(float(angle) for angle in np.radians((0.0, 30.0, 60.0, 80.0)))
INCIDENCE = float(np.radians(45.0))


def check() -> None:
    """Errors: MissingLibrary."""
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        raise MissingLibrary("plots need matplotlib: pip install 'glshade[plot]'") from None


def check_suffix(path: Path) -> None:
    """Errors: GlshadeError where the extension names no format that figures are written in."""
    if path.suffix.lower() not in SUFFIXES:
        raise GlshadeError(
            f"{path}: cannot write a figure as {path.suffix or 'a file without extension'}; allowed: {', '.join(SUFFIXES)}"
        )


def figure(
    materials: Mapping[str, Brdf],
    kinds: Sequence[Kind] = KINDS,
    *,
    angles: Sequence[float] = ANGLES,
    incidence: float = INCIDENCE,
    azimuth: float = 0.0,
    quantity: Quantity = "f cos",
    scale: Scale = "auto",
    renderer: Renderer | None = None,
) -> Figure:
    """A sheet of panels, one or more a kind; materials (label -> material, none of them textured) are laid over each other.

    angles: of incidence, of the slices; incidence: of the solid lobes; azimuth: of the plane of incidence to the tangent; all
    in radians. scale: of slices and lobes; auto: by the log where a linear scale would hide curves. renderer: left out, one is
    made for the call if a kind is drawn by it. Errors: MissingLibrary, ValueError for a texture, ContextError.
    """
    check()
    from glshade.catalogue.sheet import Sheet

    if renderer is None and DRAWN & set(kinds):
        from glshade.gl.renderer import Renderer

        with Renderer() as own:
            return Sheet(materials, tuple(angles), incidence, azimuth, quantity, scale, own).figure(kinds)
    return Sheet(materials, tuple(angles), incidence, azimuth, quantity, scale, renderer).figure(kinds)


def save(figure: Figure, path: str | Path) -> None:
    """Writes SVG, PNG or PDF, as the extension says. No time of day inside; the file appears whole or not at all.

    Errors: GlshadeError.
    """
    from matplotlib import style

    from glshade.catalogue.sheet import STYLE

    path = Path(path)
    check_suffix(path)
    if not path.parent.is_dir():
        raise GlshadeError(f"{path}: the folder {path.parent} does not exist; make it first")
    metadata: dict[str, dict[str, Any]] = {
        ".svg": {"Date": None, "Creator": "glshade"},
        ".png": {"Software": "glshade"},
        ".pdf": {"CreationDate": None, "Creator": "glshade"},
    }
    suffix = path.suffix.lower()
    try:
        # Not as the user's own style would have it: ticks are made now. Names of clip paths would be random without a salt.
        with replacing(path) as beside, style.context(["default", STYLE, {"svg.hashsalt": "glshade"}]):
            figure.savefig(beside, format=suffix[1:], metadata=metadata[suffix])
    except OSError as error:
        raise GlshadeError(f"{path}: cannot be written: {error.strerror}") from None
