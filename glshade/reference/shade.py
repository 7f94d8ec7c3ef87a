"""Shade: computes the linear light from fragments toward the viewer.

The models are evaluated by their Python functions in local coordinates (z along the normal). The position of the sample, the
level of detail and the precision can be varied, to find out how far the picture depends on them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.radiance.draw import Draw
from glshade.radiance.surface import Surface, alpha_of, at_vertices, evaluate_surface, toward_viewer
from glshade.reference.division import by_structure
from glshade.reference.inputs import Inputs
from glshade.reference.interpolate import blend, weights
from glshade.reference.raster import Fragments

Array = NDArray[Any]


@dataclass(frozen=True)
class Sampling:
    """The conditions under which fragments are shaded.

    offset: the sample's distance from the pixel's centre, (right, down) [pixels].
    level: a number that is added to the level of detail of textures.
    dtype: the precision of the vertex stage and of all steps after the interpolation.
    decoded: the linear value (256,) of each sRGB code of textures, as a driver decodes it; by default, the exact value.
    """

    offset: tuple[float, float] = (0.0, 0.0)
    level: float = 0.0
    dtype: Any = np.float64
    decoded: tuple[float, ...] = ()


AT_CENTRE = Sampling()


def shade_fragments(inputs: Inputs, fragments: Fragments, sampling: Sampling = AT_CENTRE) -> Array:
    """Returns the colours (N, 4) of fragments, linear Rec. 709 and premultiplied. Fragments of cut-outs are not discarded.

    inputs: the scene with its uploaded values.
    fragments: fragments of any draws in any order.
    sampling: where and how precisely they are shaded.
    """
    result = np.zeros((len(fragments), 4), dtype=sampling.dtype)
    for draw, indices, part in by_structure(inputs, fragments):
        light = _RATES[draw.instance.rate](draw, part, inputs.size, sampling)
        if draw.alpha_mode == "blend":
            alpha = alpha_of(draw, surface_at(draw, part, inputs.size, sampling))[:, None]
            result[indices] = np.concatenate([light * alpha, alpha], axis=1)
        else:
            result[indices, :3], result[indices, 3] = light, 1.0
    return result


def opacity(inputs: Inputs, fragments: Fragments, sampling: Sampling = AT_CENTRE) -> Array:
    """Returns the alpha (N,) of fragments from material, texture and vertex colour, before a cut-out compares it with its
    cutoff.
    """
    result = np.ones(len(fragments), dtype=sampling.dtype)
    for draw, indices, part in by_structure(inputs, fragments):
        if draw.alpha_mode != "opaque":
            result[indices] = alpha_of(draw, surface_at(draw, part, inputs.size, sampling))
    return result


def is_there(inputs: Inputs, fragments: Fragments, sampling: Sampling = AT_CENTRE) -> NDArray[np.bool_]:
    """Returns whether each fragment (N,) is kept. A fragment of a cut-out is discarded if its alpha is below the cutoff."""
    cutoff = np.array([draw.alpha_cutoff if draw.alpha_mode == "mask" else -np.inf for draw in inputs.draws])
    kept: NDArray[np.bool_] = opacity(inputs, fragments, sampling) >= cutoff[fragments.draw].astype(sampling.dtype)
    return kept


def _per_pixel(draw: Draw, fragments: Fragments, size: tuple[int, int], sampling: Sampling) -> Array:
    """Returns the light (N, 3) of fragments that are shaded at their samples."""
    surface = surface_at(draw, fragments, size, sampling)
    sides = draw.instance.back_faces
    side = np.where(fragments.front | (not sides), 1.0, -1.0).astype(sampling.dtype)
    return evaluate_surface(draw, replace(surface, side=side))


def _per_vertex(draw: Draw, fragments: Fragments, size: tuple[int, int], sampling: Sampling) -> Array:
    """Returns the light (N, 3) of fragments, shaded at the corners for the side that the fragment shows, and interpolated."""
    corners = draw.triangles[fragments.triangle]
    x, y = places(fragments, size, sampling)
    weight = weights(draw, fragments.triangle, x, y, size, derivatives=False).values.astype(sampling.dtype)
    result = np.zeros((len(fragments), 3), dtype=sampling.dtype)
    back = ~fragments.front & draw.instance.back_faces
    for side, which in ((1.0, np.flatnonzero(~back)), (-1.0, np.flatnonzero(back))):
        if len(which):
            vertices, place = np.unique(corners[which], return_inverse=True)
            surface = at_vertices(draw, vertices, sampling.dtype)
            light = evaluate_surface(draw, replace(surface, side=np.full(len(vertices), side, dtype=sampling.dtype)))
            result[which] = blend(weight[which], light[place.reshape(-1, 3)])
    return result


def _per_face(draw: Draw, fragments: Fragments, size: tuple[int, int], sampling: Sampling) -> Array:
    """Returns the light (N, 3) of fragments whose triangle is shaded once, at its centroid."""
    faces, place = np.unique(fragments.triangle, return_inverse=True)
    surface = at_vertices(draw, draw.triangles[faces, 2], sampling.dtype, centroids=True)
    if draw.instance.back_faces:
        facing = np.einsum("ij,ij->i", surface.normal, toward_viewer(draw, surface.position)) >= 0
        surface = replace(surface, side=np.where(facing, 1.0, -1.0).astype(sampling.dtype))
    result: Array = evaluate_surface(draw, surface)[place]
    return result


_RATES = {"phong": _per_pixel, "gouraud": _per_vertex, "flat": _per_face}


def places(fragments: Fragments, size: tuple[int, int], sampling: Sampling) -> tuple[Array, Array]:
    """Returns the positions x, y (N,) of the fragments' samples in the picture [pixels]."""
    y, x = np.divmod(fragments.pixel.astype(np.intp), size[0])
    return x + 0.5 + sampling.offset[0], y + 0.5 + sampling.offset[1]


def surface_at(draw: Draw, fragments: Fragments, size: tuple[int, int], sampling: Sampling) -> Surface:
    """Returns the interpolated surface attributes at the samples of fragments."""
    triangle = fragments.triangle
    x, y = places(fragments, size, sampling)
    textured = bool(draw.pictures)
    weight = weights(draw, triangle, x, y, size, derivatives=textured)
    vertices, place = np.unique(draw.triangles[triangle], return_inverse=True)
    corner = at_vertices(draw, vertices, sampling.dtype)
    place = place.reshape(-1, 3)

    def at(values: Array | None, by: Array = weight.values) -> Any:
        return None if values is None else blend(by.astype(sampling.dtype), values[place])

    footprint = None
    if textured and corner.uv is not None:
        footprint = at(corner.uv, weight.dx), at(corner.uv, weight.dy)
    return Surface(
        side=np.ones(len(triangle), dtype=sampling.dtype),
        position=at(corner.position),
        normal=at(corner.normal),
        tangent=at(corner.tangent),
        uv=at(corner.uv),
        colour=at(corner.colour),
        footprint=footprint,
        level=sampling.level,
        member=None if corner.member is None else corner.member[place[:, 0]],
    )
