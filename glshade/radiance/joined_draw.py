"""Joined draw: draws that differ only in numbers, computed together.

NumPy takes about as long for one point as for a thousand. A scene of many small objects is therefore computed in few large
pieces: a joined draw has the triangles of several draws, and a row of each value for each of them.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.radiance.draw import Draw
from glshade.radiance.sampler import Sampler
from glshade.textures.volume import Volume

Array = NDArray[Any]
Indices = NDArray[np.intp]

# Arrays of more bytes, such as texels, count as the same only if they are one object.
SMALL = 1024
# The fields of a draw that may differ between joined draws, because they are numbers of which each point takes its own.
_NUMBERS = frozenset(
    {"ambient", "emission", "occlusion", "parameters", "added", "normal_scale", "turn", "alpha", "alpha_cutoff"}
)
# The fields of a draw that only place its vertices. The joined draws place theirs themselves.
_PLACES = frozenset({"instance", "triangles", "world_from_object", "normal_from_object"})


@dataclass(frozen=True, eq=False)
class Corners:
    """Some triangles of several draws, with the vertices that these triangles have.

    members: the K draws.
    triangles: vertex indices (T, 3) into the V vertices here.
    member: (V,), ascending, the index in `members` of the draw that each vertex belongs to.
    vertex: (V,), the index of each vertex in the mesh of its draw.
    """

    members: tuple[Draw, ...]
    triangles: Indices
    member: Indices
    vertex: Indices

    @classmethod
    def of(cls, members: Sequence[Draw], member: Indices, triangle: Indices) -> Corners:
        """Returns the corners of T triangles. member: (T,), ascending. triangle: (T,), the row of its draw's triangles."""
        rows = _gathered([draw.triangles for draw in members], member, triangle)
        # Vertices are numbered so that those of each draw come after all of the draw before.
        stride = int(rows.max(initial=0)) + 1
        numbers, place = np.unique(rows + member[:, None] * stride, return_inverse=True)
        owner, vertex = np.divmod(numbers, stride)
        return cls(tuple(members), place.reshape(-1, 3), owner, vertex)

    @classmethod
    def whole(cls, members: Sequence[Draw]) -> Corners:
        """Returns all triangles and all vertices of draws."""
        counts = np.array([len(draw.instance.mesh.positions) for draw in members])
        starts = np.cumsum(counts) - counts
        triangles = np.concatenate([draw.triangles + start for draw, start in zip(members, starts, strict=True)])
        owner = np.repeat(np.arange(len(counts)), counts)
        return cls(tuple(members), triangles, owner, np.arange(len(owner)) - starts[owner])

    @property
    def back_faces(self) -> bool:
        """Whether back faces are drawn."""
        return self.members[0].back_faces

    @cached_property
    def clip(self) -> Array:
        """The positions of the vertices in clip space (V, 4)."""
        return self.gathered(lambda draw: draw.clip)

    @cached_property
    def world_terms(self) -> Array:
        """The sums (V, 3) of absolute values, as in `Draw.world_terms`."""
        return self.gathered(lambda draw: draw.world_terms)

    @cached_property
    def clip_terms(self) -> Array:
        """The sums (V, 4) of absolute values, as in `Draw.clip_terms`."""
        return self.gathered(lambda draw: draw.clip_terms)

    @cached_property
    def identities(self) -> Array:
        """Rows (V, 4) that are equal for vertices of the same draw that lie at the same position."""
        positions = self.gathered(lambda draw: draw.instance.mesh.positions)
        return np.column_stack([positions + 0.0, self.member])

    def gathered(self, values: Callable[[Draw], Array]) -> Array:
        """Returns the rows (V, ...) of the vertices, from values that have a row for each vertex of a draw's mesh."""
        return _gathered([values(draw) for draw in self.members], self.member, self.vertex)


@dataclass(frozen=True, eq=False, kw_only=True)
class JoinedDraw(Draw):
    """Several draws of the same structure, as one draw of some of their triangles.

    Numbers that are not the same for all K members have K rows. `Surface.member` says which row a point takes.
    corners: the triangles and their vertices.
    kept: the surfaces at the vertices that were computed already, by their number type and place (surface.py).
    """

    corners: Corners
    kept: dict[Hashable, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, corners: Corners) -> JoinedDraw:
        """Returns the joined draw of draws that have the same `structure`."""
        first = corners.members[0]
        values = {f.name: getattr(first, f.name) for f in fields(Draw)}
        for name in _NUMBERS:
            values[name] = _rows([getattr(draw, name) for draw in corners.members])
        return cls(**{**values, "triangles": corners.triangles}, corners=corners)

    @cached_property
    def clip(self) -> Array:
        return self.corners.clip

    @cached_property
    def world_terms(self) -> Array:
        return self.corners.world_terms

    @cached_property
    def clip_terms(self) -> Array:
        return self.corners.clip_terms

    @cached_property
    def identities(self) -> Array:
        return self.corners.identities


def structure(draw: Draw) -> Hashable:
    """Returns a key that is the same for draws that can be joined: those whose light is computed by the same steps."""
    instance, material, mesh = draw.instance, draw.instance.material, draw.instance.mesh
    if draw.text is not None or instance.shows != "light":
        return id(draw)
    arrays = ("normals", "uvs", "tangents", "colours", "centroids", "centroid_uvs", "centroid_colours")
    return (
        type(material),
        tuple(material.chosen().items()),
        tuple(getattr(material, name) is None for name in material.parameters()),
        material.alpha_mode,
        (instance.rate, instance.back_faces, instance.vertex_colours),
        tuple(getattr(mesh, name) is None for name in arrays),
        tuple(_key(getattr(draw, f.name)) for f in fields(Draw) if f.name not in _NUMBERS | _PLACES),
    )


def sides(draw: Draw) -> Hashable:
    """Returns a key that is the same for draws whose triangles can be joined where only their places count."""
    return draw.back_faces


def _key(value: Any) -> Hashable:
    """Returns a key that is the same only for values that have the same effect on the light."""
    if value is None or isinstance(value, str | bool | int | float):
        return value
    if isinstance(value, np.ndarray) and value.nbytes <= SMALL:
        return value.shape, value.tobytes()
    if isinstance(value, dict):
        return tuple((name, _key(part)) for name, part in value.items())
    if isinstance(value, tuple):
        return tuple(map(_key, value))
    if isinstance(value, Sampler | Volume):
        return tuple(_key(getattr(value, f.name)) for f in fields(value))
    return id(value)


def _rows(values: list[Any]) -> Any:
    """Returns the values of all members: one for all of them if they are the same, otherwise an array with a row for each."""
    if isinstance(values[0], dict):
        return {name: _rows([value[name] for value in values]) for name in values[0]}
    rows = np.array(values)
    return values[0] if (rows == rows[0]).all() else rows


def _gathered(values: list[Array], member: Indices, row: Indices) -> Array:
    """Returns the rows (N, ...) of the members' values. member: (N,), ascending. row: (N,), the rows in the member's values."""
    ends = np.searchsorted(member, np.arange(len(values) + 1))
    return np.concatenate([value[row[ends[k] : ends[k + 1]]] for k, value in enumerate(values)])
