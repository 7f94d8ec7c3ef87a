"""Background: finds the box of a picture outside of which every pixel shows the background and need not be drawn."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.arrays import Float64
from glshade.assembly.assembly import Assembly
from glshade.gl.frame import Box
from glshade.scene.film import Film

# The box is larger than the projected corners by this on each side [pixels]: samples and shifted pictures of supersampling lie
# within one pixel, float32 moves vertices by less than another, and the outermost line has to show the background.
MARGIN = 4
# A smaller picture, or one of which a larger share is covered, is drawn whole: cutting it out would take as long as it saves.
LEAST_PIXELS, LARGEST_SHARE = 100 * 100, 0.5
# Of a scene with more objects, the box round all of them is projected.
MOST_BOXES = 1000


def covered(assembly: Assembly, film: Film, wanted: Box) -> Box | None:
    """Returns the box of pixels to draw for a wanted box; None where the wanted box is better drawn whole.

    At least one of the sides of the result lies within the wanted box, and its pixels there show the background.
    """
    left, top, width, height = wanted
    if width * height < LEAST_PIXELS:
        return None
    extent = _extent(assembly, film)
    if extent is None:
        return None
    first = np.clip(extent[0], (left, top), (left + width - 1, top + height - 1))
    last = np.clip(extent[1], first + 1, (left + width, top + height))
    x, y, right, bottom = (int(number) for number in (*first, *last))
    return (x, y, right - x, bottom - y) if (right - x) * (bottom - y) <= LARGEST_SHARE * width * height else None


def _extent(assembly: Assembly, film: Film) -> Float64 | None:
    """Returns the least and the largest coordinates (2, 2) of all objects in the picture, with a margin [pixels].

    The result is None where an object reaches behind the near plane. x points to the right and y down.
    """
    view, pieces = assembly.view, assembly.pieces
    if not pieces:
        return None
    boxes = pieces.boxes if len(pieces) <= MOST_BOXES else pieces.extent[np.indices((2, 2, 2)).reshape(3, -1).T, np.arange(3)]
    corners = boxes.reshape(-1, 3) * assembly.unit
    depth = view.depth(corners)
    if not depth.min() > view.near:
        return None
    scale = depth if view.perspective else np.ones_like(depth)
    across, up = ((corners - view.eye) @ view.axes[:2].T / scale[:, None] / (view.half_width, view.half_height)).T
    x = (1 + across + view.centre[0]) / 2 * film.size[0]
    y = (1 - up - view.centre[1]) / 2 * film.size[1]
    margin = MARGIN + film.point_size
    result = np.array([[np.floor(x.min()) - margin, np.floor(y.min()) - margin], [x.max() + margin, y.max() + margin]])
    return result.round() if np.isfinite(result).all() else None


def surrounded(inner: NDArray[Any], box: Box, wanted: Box, out: NDArray[Any]) -> None:
    """Fills the pixels `out` (h, w, 4) of a wanted box with those of a covered box, and with the background round it.

    inner: the pixels (H, W, 4) of the covered box.
    """
    x, y, width, height = box
    left, top, w, h = wanted
    # The corner of the covered box that lies on a side within the wanted box.
    row = 0 if y > top or y + height == top + h else -1
    column = 0 if x > left or x + width == left + w else -1
    out[...] = inner[row, column]
    out[y - top :, x - left :][:height, :width] = inner
