"""Pieces: the fragments of a picture that may be visible, and the freedom that a driver has in drawing each of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.reference.bounds import alphas
from glshade.reference.freedom import Freedom
from glshade.reference.inputs import Inputs
from glshade.reference.planes import Depths, depths, may_turn
from glshade.reference.raster import Fragments, rasterise
from glshade.reference.sealing import sheets
from glshade.verification.judgement import classify

Array = NDArray[Any]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Pieces:
    """N fragments, and the freedom that a driver has in drawing each of them.

    fragments: the N fragments.
    depths: the depths that they may have at the samples of their pixels.
    partial: (N,), True where a driver may leave the fragment out at one of the pixel's samples.
    sheet: (N,), the number of the sheet that a partial fragment belongs to; -1 if it belongs to none. The fragments of a sheet
        certainly cover their pixel together.
    """

    fragments: Fragments
    depths: Depths
    partial: Flags
    sheet: NDArray[Any]

    @property
    def anywhere(self) -> Flags:
        """Whether (N,) a triangle may cover only some of its pixel's samples, or be cut into triangles that do."""
        return self.fragments.partial | self.depths.cut

    def take(self, which: Any) -> Pieces:
        """Returns the pieces that an index array or a mask selects."""
        return Pieces(self.fragments.take(which), self.depths.take(which), self.partial[which], self.sheet[which])


@dataclass(frozen=True, eq=False)
class Visible:
    """What may be visible in a whole picture of P pixels, before any crop.

    solid: the fragments of opaque surfaces that may be visible, sorted by pixel. If pixels have several samples, the nearest
        one that covers the pixel's centre comes first.
    layers: the fragments of blended surfaces that may be visible, sorted by pixel and within a pixel from the first drawn to
        the last.
    classes: the PixelClass (P,) of each pixel, from opaque surfaces alone.
    open: (P,), True where no opaque surface may be visible.
    """

    solid: Pieces
    layers: Pieces
    classes: NDArray[np.uint8]
    open: Flags


def visible(inputs: Inputs, driver: Freedom) -> Visible:
    """Returns what may be visible in a picture."""
    width, height = inputs.size
    solid, layers = _visible(inputs, driver)
    if inputs.extent:
        solid = solid.take(~_behind(solid, inputs))
    kept, classes, open_, hidden = classify(
        width * height,
        solid.fragments.pixel,
        solid.depths.nearest,
        solid.depths.farthest,
        solid.partial,
        solid.sheet,
    )
    solid = solid.take(kept)
    fragments = solid.fragments
    # With several samples per pixel, the nearest surface at the centre comes first.
    keys = (-fragments.depth, ~fragments.covered, fragments.pixel) if inputs.extent else (fragments.pixel,)
    solid = solid.take(np.lexsort(keys))
    layers = layers.take(layers.depths.nearest >= hidden[layers.fragments.pixel])
    layers = layers.take(np.lexsort((layers.fragments.triangle, layers.fragments.draw, layers.fragments.pixel)))
    return Visible(solid, layers, classes, open_)


def _visible(inputs: Inputs, driver: Freedom) -> tuple[Pieces, Pieces]:
    """Returns (opaque, blended): the pieces that may be visible. Hidden pieces are dropped early to save memory."""
    width, height = inputs.size
    hidden = np.full(width * height, -np.inf)
    modes = np.array([draw.alpha_mode for draw in inputs.draws])
    parts: dict[bool, list[tuple[Fragments, Depths]]] = {False: [], True: []}
    for part in rasterise(inputs, driver.margin):
        if not inputs.extent:
            # A cheap first test with a fixed depth margin drops most hidden fragments before their depths are computed.
            part = part.take(part.depth + 1e-6 >= hidden[part.pixel])
        z = depths(inputs, part, driver)
        # Fragments in front of the near plane or behind the far plane are not drawn. If a fragment may be on either side of a
        # plane, a driver may draw it or not.
        inside = (z.nearest >= 0) & (z.farthest <= 1)
        possible = inside & (z.nearest >= hidden[part.pixel])
        part = replace(part, partial=part.partial | _crosses(z)).take(possible)
        z = z.take(possible)
        opaque = (modes[part.draw] == "opaque") & ~part.partial
        np.maximum.at(hidden, part.pixel[opaque], z.farthest[opaque])
        blended = modes[part.draw] == "blend"
        for kind in (False, True):
            which = np.flatnonzero(blended == kind)
            if len(which):
                parts[kind].append((part.take(which), z.take(which)))
    pieces = []
    for kind in (False, True):
        fragments = Fragments.joined(part for part, _ in parts[kind])
        z = Depths.joined(part for _, part in parts[kind])
        near = np.flatnonzero(z.nearest >= hidden[fragments.pixel])
        # A part may hold fragments of several draws, with those of triangles that are clipped after all others.
        near = near[np.argsort(fragments.draw[near], kind="stable")]
        pieces.append(_settled(inputs, fragments.take(near), z.take(near), driver))
    return pieces[0], pieces[1]


def _settled(inputs: Inputs, fragments: Fragments, z: Depths, driver: Freedom) -> Pieces:
    """Returns the fragments (N,) as pieces.

    Fragments that the alpha test certainly discards are dropped. Fragments that it may discard become partial. Some triangles
    are so thin that a driver may see either side: their fragments are listed twice, once for each side.
    z: their depths.
    """
    cutoff = np.array([draw.alpha_cutoff if draw.alpha_mode == "mask" else -np.inf for draw in inputs.draws])
    masked = np.flatnonzero(cutoff[fragments.draw] > -np.inf)
    uncertain = np.zeros(len(fragments), dtype=np.bool_)
    if len(masked):
        _, low, high = alphas(inputs, fragments.take(masked), driver, (fragments.partial | z.cut)[masked])
        limit = cutoff[fragments.draw[masked]]
        uncertain[masked] = low < limit
        kept = np.ones(len(fragments), dtype=np.bool_)
        kept[masked] = high >= limit
        fragments, z, uncertain = fragments.take(kept), z.take(kept), uncertain[kept]
    # The near or the far plane may cut a triangle within the pixel, where no neighbour covers what it leaves out.
    uncertain |= _crosses(z)
    partial = fragments.partial | uncertain
    sheet = np.full(len(fragments), -1)
    which = np.flatnonzero(fragments.partial & ~uncertain)
    pieces = Pieces(fragments, z, partial, sheet)
    if not len(which):
        return pieces
    sheet[which] = sheets(inputs, fragments.take(which), driver)
    turned = which[may_turn(inputs, fragments.take(which), driver)]
    if not len(turned):
        return pieces
    other = replace(fragments.take(turned), front=~fragments.front[turned])
    return Pieces(
        Fragments.joined([fragments, other]),
        Depths.joined([z, z.take(turned)]),
        np.concatenate([partial, partial[turned]]),
        np.concatenate([sheet, sheet[turned]]),
    )


def _crosses(z: Depths) -> Flags:
    """Returns whether each fragment (N,) may be on either side of the near or the far plane."""
    crosses: Flags = (z.farthest <= 0) | (z.nearest >= 1)
    return crosses


def _behind(pieces: Pieces, inputs: Inputs) -> Flags:
    """Returns whether each piece (N,) lies certainly behind another one in the whole square in which its pixel has samples.

    Depths are linear functions over the picture, so that it is enough to compare them at the square's corners. Two surfaces
    that lean alike are told apart in this way, even where the depth changes by more in a pixel than it differs between them.
    """
    width, height = inputs.size
    pixel, z = pieces.fragments.pixel, pieces.depths
    certain = np.flatnonzero(~pieces.partial)
    front = np.full(width * height, -1)
    order = certain[np.argsort((pieces.fragments.depth - z.slack)[certain], kind="stable")]
    # Of the pieces that cover all samples of a pixel, the last to be assigned is the nearest one.
    front[pixel[order]] = order
    other = front[pixel]
    behind = other >= 0
    gap = pieces.fragments.depth[other] - pieces.fragments.depth - z.slack[other] - z.slack
    lean = z.slope[other] - z.slope
    for right, down in product((-inputs.extent, inputs.extent), repeat=2):
        behind &= gap + lean[:, 0] * right + lean[:, 1] * down > 0
    return behind
