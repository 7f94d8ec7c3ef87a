"""Shaders: the classical mistakes of shader programs, such as reversed normals."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.golden.faults.fitting import Fitting, SceneFault
from glshade.radiance.draw import Draw
from glshade.reference.raster import Fragments
from glshade.reference.shade import AT_CENTRE, surface_at

Array = NDArray[Any]


class _Changed:
    """A reflectance model whose value is computed with other directions than the model is given."""

    def __init__(self, model: Any, directions: Callable[[Array, Array], tuple[Array, Array]]) -> None:
        self._model, self._directions = model, directions

    def __getattr__(self, name: str) -> Any:
        return getattr(self._model, name)

    def brdf_cos(self, m: Any, l: Array, v: Array) -> Array:
        value: Array = self._model.brdf_cos(m, *self._directions(l, v))
        return value


class _Modelled(Draw):
    """A draw with a changed model, which lies in the attribute `changed` of the instance."""

    @property
    def model(self) -> Any:
        return self.__dict__["changed"]


def _with_directions(draw: Draw, directions: Callable[[Array, Array], tuple[Array, Array]]) -> Draw:
    """Returns a draw whose model is given other directions (N, 3) to the light and to the viewer, about the normal."""
    result = _Modelled(**{name: getattr(draw, name) for name in draw.__dataclass_fields__})
    result.__dict__["changed"] = _Changed(draw.model, directions)
    return result


def mistakes(fitting: Fitting) -> Iterator[SceneFault]:
    """Yields the pictures with classical mistakes of shaders."""
    size = fitting.surfaces.inputs.size
    for kind, text, edit in _EDITS:
        light = fitting.surfaces.with_edit(lambda draw, fragments, edit=edit: edit(draw, fragments, size))  # type: ignore[misc]
        if not np.array_equal(light, fitting.surfaces.light):
            yield SceneFault(kind, text + " on {objects}", "shading", light)


def _reversed(draw: Draw, fragments: Fragments, size: tuple[int, int]) -> Draw:
    return replace(draw, normal_from_object=-draw.normal_from_object)


def _unnormalised(draw: Draw, fragments: Fragments, size: tuple[int, int]) -> Draw:
    """Interpolated normals keep their length, so that cosines become too small."""
    if draw.instance.rate != "phong":
        return draw
    length = np.linalg.norm(surface_at(draw, fragments, size, AT_CENTRE).normal, axis=1)

    def directions(l: Array, v: Array) -> tuple[Array, Array]:
        scale = np.stack([np.ones_like(length), np.ones_like(length), length], axis=1)
        return l * scale, v * scale

    return _with_directions(draw, directions)


def _exchanged(draw: Draw, fragments: Fragments, size: tuple[int, int]) -> Draw:
    return _with_directions(draw, lambda l, v: (v, l))


def _two_sided(draw: Draw, fragments: Fragments, size: tuple[int, int]) -> Draw:
    return _with_directions(draw, lambda l, v: (np.concatenate([l[:, :2], np.abs(l[:, 2:])], axis=1), v))


def _with_tangents(draw: Draw, change: Callable[[Array, Array], Array]) -> Draw:
    """Returns a draw with other tangents. change: a function from normals (V, 3) and tangents (V, 4) to tangents (V, 4)."""
    mesh = draw.instance.mesh
    if not draw.tangents or mesh.tangents is None or mesh.normals is None:
        return draw
    return replace(draw, instance=replace(draw.instance, mesh=replace(mesh, tangents=change(mesh.normals, mesh.tangents))))


def _mirrored(draw: Draw, fragments: Fragments, size: tuple[int, int]) -> Draw:
    return _with_tangents(draw, lambda normals, tangents: tangents * np.array([1, 1, 1, -1], dtype=np.float32))


def _swapped(draw: Draw, fragments: Fragments, size: tuple[int, int]) -> Draw:
    def swapped(normals: Array, tangents: Array) -> Array:
        return np.concatenate([np.cross(normals, tangents[:, :3]) * tangents[:, 3:], -tangents[:, 3:]], axis=1)

    return _with_tangents(draw, swapped)


def _affine(draw: Draw, fragments: Fragments, size: tuple[int, int]) -> Draw:
    """Attributes are interpolated linearly in the picture: as if all corners had the same w."""
    if draw.viewer is not None:
        return draw
    result = replace(draw)
    result.__dict__["clip"] = draw.clip / draw.clip[:, 3:]
    return result


def _at_vertices(draw: Draw, fragments: Fragments, size: tuple[int, int]) -> Draw:
    return replace(draw, instance=replace(draw.instance, rate="gouraud")) if draw.instance.rate == "phong" else draw


def _at_pixels(draw: Draw, fragments: Fragments, size: tuple[int, int]) -> Draw:
    return replace(draw, instance=replace(draw.instance, rate="phong")) if draw.instance.rate == "gouraud" else draw


def _flipped(draw: Draw, fragments: Fragments, size: tuple[int, int]) -> Draw:
    """Textures are read upside down."""
    mesh = draw.instance.mesh
    if not draw.pictures or mesh.uvs is None:
        return draw
    upside_down = mesh.uvs * np.array([1, -1], dtype=np.float32) + np.array([0, 1], dtype=np.float32)
    return replace(draw, instance=replace(draw.instance, mesh=replace(mesh, uvs=upside_down)))


def _untextured(draw: Draw, fragments: Fragments, size: tuple[int, int]) -> Draw:
    return replace(draw, samplers={}, normal_map=None, directions=None) if draw.pictures else draw


def _smooth(draw: Draw, fragments: Fragments, size: tuple[int, int]) -> Draw:
    return replace(draw, normal_map=None) if draw.normal_map is not None else draw


def _next_cell(draw: Draw, fragments: Fragments, size: tuple[int, int]) -> Draw:
    return draw.with_tables(lambda table: replace(table, shift=(1.0, 0.0, 0.0))) if draw.tables else draw


def _reversed_depth(draw: Draw, fragments: Fragments, size: tuple[int, int]) -> Draw:
    return draw.with_tables(lambda table: replace(table, texels=table.texels[::-1])) if draw.tables else draw


def _transposed(draw: Draw, fragments: Fragments, size: tuple[int, int]) -> Draw:
    return draw.with_tables(lambda table: replace(table, texels=table.texels.swapaxes(1, 2))) if draw.tables else draw


# Name of a kind, text, and the edit of a draw, for the fragments that are shaded next and the picture's size.
_EDITS: tuple[tuple[str, str, Callable[[Draw, Fragments, tuple[int, int]], Draw]], ...] = (
    ("normals", "normals reversed", _reversed),
    ("normals", "interpolated normals not normalised", _unnormalised),
    ("two-sided", "light from behind shines through", _two_sided),
    ("directions", "directions to the light and to the viewer exchanged", _exchanged),
    ("tangents", "tangent frames mirrored", _mirrored),
    ("tangents", "tangents and bitangents exchanged", _swapped),
    ("interpolation", "attributes interpolated without perspective", _affine),
    ("rate", "shading at the vertices, not at the pixels,", _at_vertices),
    ("rate", "shading at the pixels, not at the vertices,", _at_pixels),
    ("texture", "textures upside down", _flipped),
    ("texture", "textures missing", _untextured),
    ("texture", "normal map missing", _smooth),
    ("table", "tables of reflectance read one cell beside the right one", _next_cell),
    ("table", "tables of reflectance read with a mirrored azimuth", _reversed_depth),
    ("table", "tables of reflectance read with two axes exchanged", _transposed),
)
