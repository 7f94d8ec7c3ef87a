"""PLY: the Stanford polygon format (Turk 1994), with polygons, triangle strips, edges and points.

The format defines only its syntax. The names of the properties are those that the programs of Stanford, VCG (MeshLab) and
Blender write. Colours that are integers are sRGB-encoded, as Blender writes them by default and as in pictures of integers;
colours that are floats are linear, as Mitsuba reads them and as in pictures of floats.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from glshade.arrays import Array, Float64, Int64
from glshade.mesh.reading.colours import display_colours, fractions, with_alpha
from glshade.mesh.reading.contents import Material
from glshade.mesh.reading.faces import cut, strips
from glshade.mesh.reading.file import MeshFile
from glshade.mesh.reading.ply_elements import Header, Table, header, tables

_INDICES = ("vertex_indices", "vertex_index")
_UVS = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
_COLOURS = (
    ("red", "green", "blue", "alpha"),
    ("diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"),
    ("r", "g", "b", "a"),
)


@dataclass(frozen=True)
class _Triangles:
    """The triangles of a file.

    vertices: (T, 3) the vertices of their corners.
    faces: (T,) the row of the element "face" from which each comes; -1 for those of strips.
    corners: (T, 3) the corners of faces, counted over the rows of the element; 0 for those of strips.
    """

    vertices: Int64
    faces: Int64
    corners: Int64


def read(file: MeshFile) -> None:
    """Adds the meshes of a PLY file: one part for each of its textures, and its loose edges or its points.

    Errors: AssetError.
    """
    head = header(file)
    elements = tables(file, head)
    vertex = elements.get("vertex")
    if vertex is None or not vertex.count:
        raise file.fail("holds no vertices")
    missing = [axis for axis in "xyz" if axis not in vertex.columns]
    if missing:
        raise file.fail(f"element vertex: has no property '{missing[0]}'")
    arrays: dict[str, Float64 | None] = {
        "positions": _columns(vertex, ("x", "y", "z")),
        "normals": _first(vertex, (("nx", "ny", "nz"),)),
        "uvs": _first(vertex, _UVS),
        "colours": _colours(vertex),
    }
    positions = arrays["positions"]
    assert positions is not None
    triangles = _triangles(file, elements, positions)
    edges = _loose_edges(file, elements.get("edge"), len(positions), triangles.vertices)
    if len(triangles.vertices):
        _add_triangles(file, head, elements.get("face"), triangles, arrays)
    given = {key: value for key, value in arrays.items() if key != "positions"}
    title = file.path.stem
    if len(edges):
        name = f"{title}.lines" if len(triangles.vertices) else title
        file.contents.add(name, file.build_lines("", positions, edges, **given))
    elif not len(triangles.vertices):
        file.contents.add(title, file.build_points("", positions, **given))


def _columns(table: Table, names: tuple[str, ...]) -> Float64:
    """Returns the properties with these names as an array (N, len(names))."""
    return np.column_stack([np.asarray(table.columns[name], dtype=np.float64) for name in names])


def _first(table: Table, choices: tuple[tuple[str, ...], ...]) -> Float64 | None:
    """Returns the first choice whose properties the table has, as an array (N, n); None where it has none completely."""
    names = next((names for names in choices if set(names) <= table.columns.keys()), None)
    return None if names is None else _columns(table, names)


def _colours(table: Table | None) -> Float64 | None:
    """Returns the colours of an element's rows (N, 4), linear with alpha; None where it has no colours."""
    if table is None:
        return None
    found = next((names for names in _COLOURS if set(names[:3]) <= table.columns.keys()), None)
    if found is None:
        return None
    raw = _columns(table, found if found[3] in table.columns else found[:3])
    kind = table.kinds[found[0]]
    if kind == "i1":  # a program that means bytes
        raw = np.where(raw < 0, raw + 256, raw)
    # Colours do not exceed 1, so that larger floats are bytes in another type.
    if kind[0] != "f" or (raw[:, :3] > 1).any():
        return display_colours(np.maximum(fractions(raw), 0.0))
    return with_alpha(raw)


def _triangles(file: MeshFile, elements: Mapping[str, Table], positions: Float64) -> _Triangles:
    """Returns the triangles of the elements "face" and "tristrips". Errors: AssetError for an index out of range."""
    vertices = [np.empty((0, 3), dtype=np.int64)]
    faces, corners = [np.empty(0, dtype=np.int64)], [np.empty((0, 3), dtype=np.int64)]
    face = elements.get("face")
    if face is not None and face.count:
        counts, indices = _indices(file, "face", face)
        _check_range(file, "face", counts, indices, 0, len(positions))
        try:
            cut_corners, owners = cut(indices, counts, positions)
        except ValueError as error:
            raise file.fail(f"element face: {error}") from None
        vertices.append(indices[cut_corners])
        faces.append(owners)
        corners.append(cut_corners)
        if few := int(np.sum(counts < 3)):
            file.warn(f"{few:,} faces have fewer than 3 corners; drawn without them")
    strip = elements.get("tristrips")
    if strip is not None and strip.count:
        counts, indices = _indices(file, "tristrips", strip)
        _check_range(file, "tristrips", counts, indices, -1, len(positions))
        separated = np.insert(indices, np.cumsum(counts), -1)
        vertices.append(separated[strips(separated)])
        faces.append(np.full(len(vertices[-1]), -1, dtype=np.int64))
        corners.append(np.zeros((len(vertices[-1]), 3), dtype=np.int64))
    return _Triangles(np.concatenate(vertices), np.concatenate(faces), np.concatenate(corners))


def _indices(file: MeshFile, name: str, table: Table) -> tuple[Int64, Int64]:
    """Returns the numbers of corners of an element's rows, and the vertex indices of all rows. Errors: AssetError."""
    found = next((table.lists[key] for key in _INDICES if key in table.lists), None)
    if found is None:
        raise file.fail(f"element {name}: has no list 'vertex_indices'")
    return found[0], _integers(file, f"element {name}", found[1])


def _integers(file: MeshFile, where: str, values: Array) -> Int64:
    """Returns vertex indices, which a file may hold as numbers of any type, as integers. Errors: AssetError."""
    # Larger numbers than 2^62 are out of every range, and some do not fit into an integer.
    if values.dtype.kind == "f" and not (np.floor(values) == values).all():
        raise file.fail(f"{where}: {values[np.floor(values) != values][0]:g} is no vertex index")
    integers: Int64 = (
        np.clip(values, -(2.0**62), 2.0**62).astype(np.int64) if values.dtype.kind != "i" else values.astype(np.int64)
    )
    return integers


def _check_range(file: MeshFile, name: str, counts: Int64, indices: Int64, least: int, count: int) -> None:
    """Checks that all indices lie from `least` to count - 1. Errors: AssetError, with the row of the first that does not."""
    wrong = (indices < least) | (indices >= count)
    if wrong.any():
        first = int(wrong.argmax())
        row = int(np.searchsorted(np.cumsum(counts), first, side="right"))
        raise file.fail(f"element {name}, row {row:,}: vertex index {indices[first]} is out of range: the file has {count:,}")


def _loose_edges(file: MeshFile, table: Table | None, count: int, triangles: Int64) -> Int64:
    """Returns the edges (S, 2) of the element "edge" that are no sides of triangles (T, 3). Errors: AssetError."""
    ends = _first(table, (("vertex1", "vertex2"),)) if table is not None and table.count else None
    if ends is None:
        return np.empty((0, 2), dtype=np.int64)
    edges = _integers(file, "element edge", ends)
    _check_range(file, "edge", np.full(len(edges), 2), edges.reshape(-1), 0, count)

    def keys(pairs: Int64) -> Int64:
        result: Int64 = pairs.min(axis=1) * count + pairs.max(axis=1)
        return result

    sides = np.concatenate([keys(triangles[:, [a, b]]) for a, b in ((0, 1), (1, 2), (2, 0))])
    return edges[~np.isin(keys(edges), sides)]


def _add_triangles(
    file: MeshFile, head: Header, face: Table | None, triangles: _Triangles, arrays: dict[str, Float64 | None]
) -> None:
    """Adds a part for each texture, and one for the triangles without a texture. Errors: AssetError."""
    colours = _colours(face)
    if colours is not None and arrays["colours"] is not None:
        file.warn("has colours of vertices and of faces; drawn with those of vertices")
        colours = None
    uvs, have_uvs = _face_uvs(file, face, triangles)
    if uvs is None:
        have_uvs = np.full(len(triangles.faces), arrays["uvs"] is not None)
    parts: list[dict[str, Any]] = []
    materials: list[Material | None] = []
    chosen = _textures(file, head, face, triangles, have_uvs)
    for number in np.unique(chosen).tolist():
        rows = np.flatnonzero(chosen == number)
        parts.append(_part(triangles, rows, arrays, uvs, colours))
        materials.append(_material(file, _pictures(head)[number]) if number >= 0 else None)
        if materials[-1] is not None and parts[-1]["colours"] is not None:
            # MeshLab writes both, and shows one of them.
            file.warn("has textures and colours; drawn with the textures where there are some")
            parts[-1]["colours"] = None
    for mesh, material in zip(file.build_surface("", parts), materials, strict=True):
        if mesh is not None:
            file.contents.add(file.path.stem, mesh, material)


def _face_uvs(file: MeshFile, face: Table | None, triangles: _Triangles) -> tuple[Float64 | None, Array]:
    """Returns the uvs (T, 3, 2) of the corners of triangles, and which triangles (T,) have any.

    They come from the faces' lists `texcoord`. The uvs are None where the file has no such lists.
    """
    if face is None or "texcoord" not in face.lists:
        return None, np.empty(0)
    lengths, values = face.lists["texcoord"]
    counts = next(face.lists[key][0] for key in _INDICES if key in face.lists)
    fits = lengths == 2 * counts
    if not fits.all():
        file.warn(f"{int(np.sum(~fits)):,} faces have no texture coordinates, or not two for each corner; drawn without them")
    have = (triangles.faces >= 0) & fits[triangles.faces]
    # The corners of a face, counted from its first, follow the same order in both lists.
    first_uv, first_corner = np.cumsum(lengths) - lengths, np.cumsum(counts) - counts
    rows = triangles.faces[have]
    at = first_uv[rows, None] + 2 * (triangles.corners[have] - first_corner[rows, None])
    uvs = np.zeros((len(have), 3, 2))
    uvs[have] = values[at[..., None] + np.arange(2)]
    return uvs, have


def _pictures(head: Header) -> list[str]:
    """Returns the names of the pictures in the lines "comment TextureFile NAME", which VCG introduced."""
    words = [comment.split(maxsplit=1) for comment in head.comments]
    return [pair[1].strip() for pair in words if len(pair) == 2 and pair[0].lower() == "texturefile"]


def _textures(file: MeshFile, head: Header, face: Table | None, triangles: _Triangles, have_uvs: Array) -> Int64:
    """Returns the number of the picture (T,) that each triangle shows; -1 for none."""
    count = len(_pictures(head))
    chosen = np.where(have_uvs, 0, -1)
    if not count:
        return np.full(len(chosen), -1)
    if not have_uvs.any():
        file.warn("names a texture, but has no texture coordinates; drawn without it")
    elif face is not None and "texnumber" in face.columns:
        with np.errstate(invalid="ignore"):
            numbers = np.nan_to_num(np.asarray(face.columns["texnumber"], dtype=np.float64), nan=-1.0).clip(-1, count)
        chosen = np.where(have_uvs & (triangles.faces >= 0), numbers[triangles.faces].astype(np.int64), -1)
        if (chosen == count).any():
            file.warn(
                f"{int(np.sum(chosen == count)):,} triangles show a texture that the file does not name; drawn without it"
            )
            chosen[chosen == count] = -1
    elif count > 1:
        file.warn(f"names {count} textures, but not which face shows which; drawn with the first")
    return chosen


def _part(
    triangles: _Triangles, rows: Int64, arrays: dict[str, Float64 | None], uvs: Float64 | None, colours: Float64 | None
) -> dict[str, Any]:
    """Returns the arguments of `MeshFile.build` for the triangles `rows`.

    uvs: (T, 3, 2), of all triangles' corners. colours: (F, 4), of faces. Where one is given, each corner gets its own vertex.
    """
    corners = triangles.vertices[rows].reshape(-1)
    used: Any
    if uvs is not None or colours is not None:
        used, local = corners, np.arange(len(corners))
    elif len(rows) == len(triangles.vertices):
        used, local = slice(None), corners
    else:
        used, local = np.unique(corners, return_inverse=True)
    part: dict[str, Any] = {key: None if value is None else value[used] for key, value in arrays.items()}
    part["triangles"] = local.reshape(-1, 3)
    if uvs is not None:
        part["uvs"] = uvs[rows].reshape(-1, 2)
    if colours is not None:
        of_faces = np.where(triangles.faces[rows, None] >= 0, colours[triangles.faces[rows]], 1.0)
        part["colours"] = np.repeat(of_faces, 3, axis=0)
    return part


def _material(file: MeshFile, picture: str) -> Material | None:
    """Returns the material that shows a picture; None where it is missing."""
    texture = file.texture(picture)
    return {"brdf": "lambert", "kd": {"texture": texture, "factor": [1.0, 1.0, 1.0]}} if texture else None
