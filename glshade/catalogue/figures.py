"""Figures: plots of materials by matplotlib, which `pip install 'glshade[plot]'` installs.

`figure({"gold": material, ...}, kinds=["polar"])` returns a matplotlib Figure, and `save(figure, path)` writes it to a file.
The same figure always gives the same bytes.
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

# The suffixes of the files that figures can be written to.
SUFFIXES = (".pdf", ".png", ".svg")
# The default angles of incidence of slices, and of solid lobes [rad].
ANGLES = tuple(float(angle) for angle in np.radians((0.0, 30.0, 60.0, 80.0)))
INCIDENCE = float(np.radians(45.0))


def check() -> None:
    """Checks that matplotlib is installed. Errors: MissingLibrary."""
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        raise MissingLibrary("plots need matplotlib: pip install 'glshade[plot]'") from None


def check_suffix(path: Path) -> None:
    """Checks that figures can be written to files with the suffix of `path`. Errors: GlshadeError."""
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
    """Returns a figure with one or more panels for each kind.

    materials: label -> material without textures; the curves of several materials share a panel.
    kinds: the kinds of panels.
    angles: the angles of incidence of the slices [rad].
    incidence: the angle of incidence of the solid lobes [rad].
    azimuth: the angle between the plane of incidence and the tangent [rad].
    quantity: the quantity that slices and lobes show.
    scale: the scale of slices and lobes; "auto" is logarithmic for slices if a linear scale would hide some of the curves.
    renderer: optional, the Renderer that draws spheres and lobes; by default, one is made if the figure has any.
    Errors: MissingLibrary, ContextError, ValueError for a textured material.
    """
    check()
    from glshade.catalogue.sheet import Sheet

    if renderer is None and DRAWN & set(kinds):
        from glshade.gl.renderer import Renderer

        with Renderer() as own:
            return Sheet(materials, tuple(angles), incidence, azimuth, quantity, scale, own).figure(kinds)
    return Sheet(materials, tuple(angles), incidence, azimuth, quantity, scale, renderer).figure(kinds)


def save(figure: Figure, path: str | Path) -> None:
    """Writes a figure as SVG, PNG or PDF, as the suffix of `path` says.

    The file holds no timestamp, so that its bytes depend on the figure alone. It appears whole or not at all.
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
        # Matplotlib lays out ticks only now. So the style is set again, or else the user's own style would apply to them.
        # Without a salt, the names of clip paths in SVG would be random.
        with replacing(path) as temporary, style.context(["default", STYLE, {"svg.hashsalt": "glshade"}]):
            figure.savefig(temporary, format=suffix[1:], metadata=metadata[suffix])
    except OSError as error:
        raise GlshadeError(f"{path}: cannot be written: {error.strerror}") from None
