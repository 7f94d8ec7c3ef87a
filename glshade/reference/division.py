"""Division: divides fragments into pieces that are computed at once.

Draws of a few fragments each are joined (glshade/radiance/joined_draw.py), because NumPy takes about as long for one fragment
as for a thousand.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from glshade.radiance.draw import Draw
from glshade.radiance.joined_draw import Corners, JoinedDraw, sides, structure
from glshade.reference.inputs import Inputs
from glshade.reference.raster import Fragments

Indices = NDArray[np.intp]

# The number of fragments that are computed at once. Their arrays then fit into the processor's caches.
PIECE = 1 << 15


def by_draw(inputs: Inputs, fragments: Fragments, whole: bool = False) -> Iterator[tuple[Draw, Indices, Fragments]]:
    """Yields (draw, indices of some of its fragments, these fragments), with at most PIECE fragments at a time.

    whole: True to yield all fragments of a draw together, even if they are more than PIECE.
    """
    for which in _pieces(inputs, fragments, id, whole):
        yield inputs.draws[fragments.draw[which[0]]], which, fragments.take(which)


def by_structure(inputs: Inputs, fragments: Fragments) -> Iterator[tuple[Draw, Indices, Fragments]]:
    """Yields (draw, indices of some fragments, these fragments), with at most PIECE fragments at a time.

    Draws whose light is computed by the same steps are joined. The fragments have the numbers of the joined draw's triangles.
    """
    for which in _pieces(inputs, fragments, structure, whole=False):
        draw, part = _joined(inputs, fragments.take(which))
        yield JoinedDraw.of(draw) if isinstance(draw, Corners) else draw, which, part


def by_sides(inputs: Inputs, fragments: Fragments, whole: bool = False) -> Iterator[tuple[Draw | Corners, Indices, Fragments]]:
    """Yields (triangles, indices of some fragments, these fragments), with at most PIECE fragments at a time.

    All draws are joined that show the same sides of their triangles: this is for what depends on places alone.
    whole: True to keep all fragments of a draw together, even if they are more than PIECE.
    """
    for which in _pieces(inputs, fragments, sides, whole):
        draw, part = _joined(inputs, fragments.take(which))
        yield draw, which, part


def _joined(inputs: Inputs, fragments: Fragments) -> tuple[Draw | Corners, Fragments]:
    """Returns the draw of fragments, or the corners of several, and the fragments with the numbers of its triangles.

    fragments: fragments in the order of their draws.
    """
    numbers, member = np.unique(fragments.draw, return_inverse=True)
    members = tuple(inputs.draws[number] for number in numbers)
    if len(members) == 1:
        return members[0], fragments
    stride = int(fragments.triangle.max()) + 1
    triangles, row = np.unique(member * stride + fragments.triangle, return_inverse=True)
    return Corners.of(members, *np.divmod(triangles, stride)), replace(fragments, triangle=row.astype(np.int32))


def _pieces(inputs: Inputs, fragments: Fragments, key: Callable[[Draw], Hashable], whole: bool) -> Iterator[Indices]:
    """Yields indices of some fragments, in the order of their draws, which all have the same key.

    whole: as for `by_sides`.
    """
    count = len(inputs.draws)
    numbers: dict[Hashable, int] = {}
    group = np.zeros(count, dtype=np.intp)
    for shown in np.flatnonzero(np.bincount(fragments.draw, minlength=count)):
        group[shown] = numbers.setdefault(key(inputs.draws[shown]), len(numbers))
    order = np.lexsort((fragments.draw, group[fragments.draw]))
    draws = fragments.draw[order]
    for first, last in pairwise(np.searchsorted(group[draws], np.arange(len(numbers) + 1)).tolist()):
        start = first
        while start < last:
            end = min(start + PIECE, last)
            if whole and end < last:
                # The piece ends before the draw that it would cut, or after it if there is no other.
                before, after = (
                    start + int(np.searchsorted(draws[start:last], draws[end], side)) for side in ("left", "right")
                )
                end = before if before > start else after
            yield order[start:end]
            start = end
