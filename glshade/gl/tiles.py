"""Tiles: the pieces that a large picture is drawn in, and the shifted pictures that are averaged to several samples."""

from __future__ import annotations

from collections.abc import Iterator

from glshade.gl.frame import Box
from glshade.scene.film import Film

# The largest side of a piece [pixels]. At 8192 x 8192 pixels, colour and depth take 1.25 GiB in float32.
TILE = 8192

# An offset of a whole picture, (right, down) [pixels].
Offset = tuple[float, float]


def shifts(count: int) -> list[Offset]:
    """Returns the count^2 points of an even grid over a pixel, row by row, as offsets from the pixel's centre."""
    steps = [(i + 0.5) / count - 0.5 for i in range(count)]
    return [(x, y) for y in steps for x in steps]


def sample_passes(samples: int, available: int) -> list[Offset]:
    """Returns the offsets of the pictures that together have the wanted number of samples per pixel.

    samples: the wanted number of samples per pixel.
    available: the largest number of samples per pixel that the driver offers in one picture.
    """
    count = max(1, -(-samples // max(available, 1)))
    # The driver's `available` samples form a rotated grid. These shifts put every sample of all pictures in a row and a column
    # of the pixel that no other sample has.
    share = 1 / (count * max(available, 1))
    return [((i - (count - 1) / 2) * share, (3 * i % count - (count - 1) / 2) * share) for i in range(count)]


def passes(film: Film, available: int) -> list[Offset]:
    """Returns the offsets of the pictures whose mean is the film's picture: one for each supersampling point and sample pass.

    film: the film of the picture.
    available: the largest number of samples per pixel that the driver offers in one picture.
    """
    samples = sample_passes(film.samples, available)
    return [(x + dx, y + dy) for x, y in shifts(film.supersample) for dx, dy in samples]


def pieces(film: Film, side: int) -> Iterator[tuple[Box, Box]]:
    """Yields (box to draw, part of this box to keep) for each piece that overlaps the film's window.

    Both boxes are in pixels of the whole picture. A crop is drawn in the same pieces as the whole picture, so that its pixels
    have the same bits.
    film: the film of the picture.
    side: the largest side of a piece [pixels].
    """
    width, height = film.size
    left, top, w, h = film.window
    # At the border of a frame, drivers place the centroid among the samples inside the frame. A margin of 2 pixels around the
    # pixels to keep avoids that.
    apron = 2 if film.samples > 1 and max(width, height) > side else 0
    # The side is even, because a driver takes derivatives in blocks of 2 x 2 pixels, and no piece must shift these blocks.
    side = max((side - 2 * apron) & ~1, 2)
    for x in range(left // side * side, left + w, side):
        for y in range(top // side * side, top + h, side):
            x0, y0 = max(x - apron, 0), max(y - apron, 0)
            x1, y1 = max(x, left), max(y, top)
            yield (
                (x0, y0, min(x + side + apron, width) - x0, min(y + side + apron, height) - y0),
                (x1, y1, min(x + side, left + w) - x1, min(y + side, top + h) - y1),
            )
