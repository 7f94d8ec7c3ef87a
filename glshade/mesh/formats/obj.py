"""OBJ: the Wavefront format with its MTL files (Wavefront, Advanced Visualizer, appendix B1)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from glshade.arrays import Array, Float64, Int64, group_starts
from glshade.limits import MOST_CORNERS, MOST_LIBRARIES
from glshade.mesh.reading import mtl
from glshade.mesh.reading.colours import display_colours
from glshade.mesh.reading.contents import Material
from glshade.mesh.reading.faces import cut
from glshade.mesh.reading.file import OUTSIDE, MeshFile, is_file, short, text_of
from glshade.mesh.reading.obj_text import ABSENT, FACE, LINE, ObjText, read_text
from glshade.mesh.reading.polygon import triangulated
from glshade.mesh.welding import weld

# The corners of a face. Cutting it takes about 200 bytes for each.
LARGEST_FACE = 1 << 20


def read(file: MeshFile) -> None:
    """Adds a part for each object, material and form of corner in an OBJ file. Errors: AssetError.

    Where the file has no objects ("o"), its groups ("g") name the parts. Points and lines are parts of their own. A file that
    holds nothing but vertices is a cloud of points.
    """
    text = read_text(file)
    if not len(text.positions):
        raise file.fail("holds no vertices" if len(text.kinds) else "holds no vertices: not an OBJ file?")
    if text.free_form:
        file.warn("free-form curves and surfaces are not drawn")
    if not len(text.kinds):
        if text.free_form:
            raise file.fail("holds only free-form curves and surfaces; export it as polygons")
        colours = None if text.colours is None else display_colours(text.colours)
        normals = text.normals if len(text.normals) == len(text.positions) else None
        file.contents.add(file.path.stem, file.build_points("", text.positions, normals=normals, colours=colours))
        return
    _check_range(file, text)
    _Parts(file, text).add()


def _check_range(file: MeshFile, text: ObjText) -> None:
    """Checks the elements of a file, and takes uvs and normals from those elements that name some which the file does not hold.

    Errors: AssetError, with the number of the line.
    """
    faces = text.kinds == FACE
    least = np.array([3, 2, 1])[text.kinds - FACE]
    few = text.counts < least
    if few.any():
        first = int(few.argmax())
        needed = ("a face needs three corners", "a line needs two corners", "'p' needs a vertex")[text.kinds[first] - FACE]
        message = f"line {text.lines[first]}: {needed}"
        if few.all():
            raise file.fail(message)
        file.warn(f"{message}; drawn without {few.sum():,} such elements")
        text.corners = text.corners[np.repeat(~few, text.counts)]
        text.kinds, text.counts, text.lines, faces = text.kinds[~few], text.counts[~few], text.lines[~few], faces[~few]
    many = np.flatnonzero(faces & (text.counts > LARGEST_FACE))
    if len(many):
        counted = f"{text.counts[many[0]]:,} corners; {LARGEST_FACE:,} are allowed"
        raise file.fail(f"line {text.lines[many[0]]}: a face has {counted}, so split it")
    ends = np.cumsum(text.counts)
    held = {"v": len(text.positions), "vt": len(text.uvs), "vn": len(text.normals)}
    for column, (word, count) in enumerate(held.items()):
        indices = text.corners[:, column]
        wrong = np.flatnonzero(indices >= count)
        if not len(wrong):
            continue
        elements = np.unique(np.searchsorted(ends, wrong, side="right"))
        message = f"line {text.lines[elements[0]]}: '{word}' index out of range: the file has {count}"
        if column == 0:
            raise file.fail(message)
        without = "texture coordinates" if word == "vt" else "normals"
        others = f" and in {len(elements) - 1:,} more elements" if len(elements) > 1 else ""
        file.warn(f"{message}; drawn without {without} there{others}")
        chosen = np.zeros(len(text.kinds), dtype=bool)
        chosen[elements] = True
        indices[np.repeat(chosen, text.counts)] = ABSENT


@dataclass
class _States:
    """The state in which each element is read.

    names: the names of objects or groups that occur.
    name: (E,) the index of the name of each element.
    materials: the names of materials that occur, or None.
    material: (E,) the index of the material of each element.
    objects: (E,) the index of the object of each element. Normals are smooth across the parts of one object.
    smoothing: (E,) the smoothing group of each element, 0 for none; None where the file says nothing about smoothing.
    libraries: the rest of each "mtllib" line.
    """

    names: list[str]
    name: Int64
    materials: list[str | None]
    material: Int64
    objects: Int64
    smoothing: Int64 | None
    libraries: list[str]


def _states(file: MeshFile, text: ObjText) -> _States:
    by_word: dict[str, list[tuple[int, str]]] = {word: [] for word in ("o", "g", "s", "usemtl", "mtllib")}
    for line, word, rest in text.states:
        by_word[word].append((line, rest))

    def values(word: str) -> tuple[list[str], Int64]:
        """Returns the different values of a statement, "" as the first, and the index of the value for each element."""
        table: dict[str, int] = {"": 0}
        events = [table.setdefault(rest, len(table)) for _, rest in by_word[word]]
        before = np.searchsorted([line for line, _ in by_word[word]], text.lines)
        return list(table), np.array([0, *events], dtype=np.int64)[before]

    objects, obj = values("o")
    names, name = (objects, obj) if by_word["o"] else values("g")
    materials, material = values("usemtl")
    smoothing = None
    if by_word["s"]:
        words, group = values("s")
        smoothing = np.array([_group(file, word) for word in words], dtype=np.int64)[group]
    absent = {"", "(null)"}  # programs write "(null)" for no material
    return _States(
        names=names,
        name=name,
        materials=[None if x in absent else x for x in materials],
        material=material,
        objects=obj,
        smoothing=smoothing,
        libraries=[rest for _, rest in by_word["mtllib"]],
    )


def _group(file: MeshFile, word: str) -> int:
    """Returns the number of a smoothing group. Until the first statement there is none, as the format says."""
    if word in ("", "off"):
        return 0
    if word == "on":
        return 1
    try:
        # Numbers of groups are labels; the remainder keeps a huge one within NumPy's integers.
        return int(word) % (1 << 62)
    except ValueError:
        file.warn(f"'s {short(word)}' is no smoothing group; drawn without smoothing there")
        return 0


class _Parts:
    """Divides the elements of a file into parts."""

    def __init__(self, file: MeshFile, text: ObjText) -> None:
        self._file, self._text = file, text
        self._states = states = _states(file, text)
        starts = np.cumsum(text.counts) - text.counts
        kinds = text.kinds
        # A part has uvs, or normals, at all corners or at none.
        form = np.zeros(len(kinds), dtype=np.int64)
        full = text.counts > 0
        for column in (1, 2):
            has = text.corners[:, column] != ABSENT
            if has.any():
                complete = np.zeros(len(kinds), dtype=bool)
                complete[full] = np.logical_and.reduceat(has, starts[full])
                text.corners[np.repeat(~complete, text.counts), column] = ABSENT
                form += complete * column
        key = ((states.name * len(states.materials) + states.material) * 4 + form) * 8 + kinds
        _, first, part = np.unique(key, return_index=True, return_inverse=True)
        # Elements of one part follow one another, and so do parts of one object.
        _, begins, same = np.unique(states.objects, return_index=True, return_inverse=True)
        rank = np.empty(len(first), dtype=np.int64)
        rank[np.lexsort((first, begins[same[first]]))] = np.arange(len(first))
        self._part = rank[part]
        self._order = np.argsort(self._part, kind="stable")
        named = {(int(n), int(m)) for n, m in zip(states.name[first], states.material[first], strict=True)}
        self._several_materials = len(named) > len({n for n, _ in named})
        self._kinds_of: dict[tuple[int, int], set[int]] = {}
        for element in first.tolist():
            self._kinds_of.setdefault(self._key(element), set()).add(int(kinds[element]))
        self._materials = self._found_materials()

    def _key(self, element: int) -> tuple[int, int]:
        return int(self._states.name[element]), int(self._states.material[element])

    def _found_materials(self) -> dict[str, Material]:
        """Returns the materials that the file uses, by name."""
        states, file = self._states, self._file
        used = {name for name in states.materials if name is not None}
        materials = _materials_of(file, states.libraries) if states.libraries else {}
        if used:
            missing = sorted(used - materials.keys())
            if materials and missing:
                more = f" and {len(missing) - 1:,} more" if len(missing) > 1 else ""
                file.warn(f"material '{short(missing[0])}'{more}: in no material file; drawn without it")
        elif len(materials) == 1:
            # Scanners write such files, as those of the YCB objects; viewers such as MeshLab use the only material.
            states.materials[0] = next(iter(materials))
        elif materials:
            file.warn(f"uses none of its {len(materials):,} materials: it has no 'usemtl'; drawn without them")
        return {name: given() for name, given in materials.items() if name in states.materials}

    def add(self) -> None:
        """Adds all parts to the contents of the file. Errors: AssetError."""
        text, order = self._text, self._order
        corner_starts = np.cumsum(text.counts) - text.counts
        counts = text.counts[order]
        if (order[1:] < order[:-1]).any():
            steps = np.arange(int(counts.sum())) - np.repeat(np.cumsum(counts) - counts, counts)
            corners = text.corners[np.repeat(corner_starts[order], counts) + steps]
        else:
            corners = text.corners
        part = self._part[order]
        starts = group_starts(part)
        ends = np.cumsum(counts)
        colours = None if text.colours is None else display_colours(text.colours)
        vertex, source = _vertices(corners, np.repeat(part, counts))
        pieces = _Pieces(text, colours, corners, vertex, source)
        surface: list[tuple[int, dict[str, Any]]] = []
        bounds = [*starts.tolist(), len(order)]
        for begin, end in pairwise(bounds):
            element = int(order[begin])
            chosen = order[begin:end]
            at = slice(int(ends[begin] - counts[begin]), int(ends[end - 1]))
            if surface and self._states.objects[surface[0][0]] != self._states.objects[element]:
                self._add_surface(surface)
                surface = []
            kind = int(text.kinds[element])
            if kind == FACE:
                triangles, smoothing = self._triangles(chosen, counts[begin:end], corners[at, 0])
                surface.append((element, pieces.arrays(at, triangles) | {"smoothing": smoothing}))
                continue
            self._add_strokes(element, kind, counts[begin:end], pieces, at)
        if surface:
            self._add_surface(surface)

    def _triangles(self, elements: Int64, counts: Int64, positions: Array) -> tuple[Int64, Int64 | None]:
        """Returns the triangles (T, 3) of faces, as indices of their corners, and the smoothing group (T,) of each."""
        if (counts == 3).all():
            triangles, polygon = np.arange(len(positions)).reshape(-1, 3), np.arange(len(counts))
        else:
            try:
                triangles, polygon = cut(positions, counts, self._text.positions)
            except ValueError:
                raise self._file.fail(self._refused(elements, counts, positions)) from None
        groups = self._states.smoothing
        return triangles, None if groups is None else groups[elements[polygon]]

    def _refused(self, elements: Int64, counts: Int64, positions: Array) -> str:
        """Returns the message about the face that could not be cut."""
        ends = np.cumsum(counts)
        for face in np.flatnonzero(counts > MOST_CORNERS):
            try:
                triangulated(self._text.positions[positions[ends[face] - counts[face] : ends[face]]])
            except ValueError as error:
                return f"line {self._text.lines[elements[face]]}: {error}"
        return "a face has too many corners"

    def _add_surface(self, parts: list[tuple[int, dict[str, Any]]]) -> None:
        """Adds the parts of one object; each has an element, for its name and material, and the arrays of its mesh."""
        meshes = self._file.build_surface("", [arrays for _, arrays in parts])
        for (element, _), mesh in zip(parts, meshes, strict=True):
            if mesh is not None:
                self._file.contents.add(self._title(element, FACE), mesh, self._material(element))

    def _add_strokes(self, element: int, kind: int, counts: Int64, pieces: _Pieces, at: slice) -> None:
        """Adds a part of points or lines."""
        indices = np.arange(int(counts.sum()))
        if kind == LINE:
            inner = np.ones(len(indices), dtype=bool)
            inner[np.cumsum(counts) - 1] = False  # a line does not go on into the next one
            indices = np.stack([indices[inner], indices[inner] + 1], axis=1)
        arrays = pieces.arrays(at, indices)
        arrays.pop("normals", None)
        strokes, positions = arrays.pop("triangles"), arrays.pop("positions")
        build = self._file.build_lines if kind == LINE else self._file.build_points
        self._file.contents.add(self._title(element, kind), build("", positions, strokes, **arrays), self._material(element))

    def _title(self, element: int, kind: int) -> str:
        number, material = self._key(element)
        name, given = self._states.names[number], self._states.materials[material] or ""
        title = name or (given if self._several_materials else "") or self._file.path.stem
        if name and given and self._several_materials:
            title = f"{name}.{given}"
        if kind != FACE and len(self._kinds_of[number, material]) > 1:
            title += ".lines" if kind == LINE else ".points"
        return title

    def _material(self, element: int) -> Material | None:
        name = self._states.materials[self._states.material[element]]
        return self._materials.get(name) if name else None


def _vertices(corners: Array, part: Array) -> tuple[Int64, Int64]:
    """Returns the vertex (C,) of each corner, and a corner (V,) of each vertex.

    Two corners of one part are one vertex if all their indices are equal. The parts must be in ascending order, as the
    vertices are then.
    """
    place, uv, normal = (corners[:, column].astype(np.int64) for column in range(3))
    if part[-1] == 0 and all((other == place).all() or (other == ABSENT).all() for other in (uv, normal)):
        # One number names all of a vertex, so that no table is needed to find equal corners.
        used = np.zeros(int(place.max()) + 1, dtype=bool)
        used[place] = True
        vertex = (np.cumsum(used) - 1)[place]
    else:
        place <<= 32
        place |= uv + 1
        normal += 1
        normal |= part.astype(np.int64) << 32
        vertex = weld(place[:, None], normal[:, None])
    source = np.empty(int(vertex.max()) + 1, dtype=np.int64)
    source[vertex] = np.arange(len(vertex))
    return vertex, source


@dataclass
class _Pieces:
    """The arrays from which the meshes of all parts are taken.

    colours: (V, 4) linear colours of the positions, or None.
    corners: (C, 3) the corners of all parts in ascending order.
    vertex: (C,) the vertex of each corner.
    source: (V,) a corner of each vertex.
    """

    text: ObjText
    colours: Float64 | None
    corners: Array
    vertex: Int64
    source: Int64

    def arrays(self, at: slice, triangles: Int64) -> dict[str, Any]:
        """Returns the arguments of `Mesh.build` for the corners of one part. triangles: (T, 3) indices into these corners."""
        own = self.vertex[at]
        first = int(own.min())
        place, uv, normal = self.corners[self.source[first : int(own.max()) + 1]].T
        result: dict[str, Any] = {"positions": self.text.positions[place], "triangles": own[triangles] - first}
        if uv[0] != ABSENT:
            result["uvs"] = self.text.uvs[uv]
        if normal[0] != ABSENT:
            result["normals"] = self.text.normals[normal]
        if self.colours is not None:
            result["colours"] = self.colours[place]
        return result


def _materials_of(file: MeshFile, libraries: list[str]) -> dict[str, mtl.Given]:
    """Returns the materials by name, each as a function that makes it. libraries: the rest of each "mtllib" line."""
    materials: dict[str, mtl.Given] = {}
    for path, name in _paths(file, libraries):
        data = None if (outside := file.is_outside(path)) else file.read(path)
        if data is None:
            file.warn(f"material file '{short(name)}' {OUTSIDE if outside else 'not found'}; drawn without its materials")
        else:
            materials = mtl.materials(file, text_of(data)) | materials
    return materials


def _paths(file: MeshFile, libraries: list[str]) -> Iterator[tuple[Path, str]]:
    """Yields the path and the name of each material file. Errors: AssetError."""
    seen: set[Path] = set()
    for line in libraries:
        # The whole line may be one name with spaces, or several names.
        for name in [line] if is_file(file.beside(line)) else line.split():
            path = file.beside(name)
            if path in seen:
                continue
            seen.add(path)
            if len(seen) > MOST_LIBRARIES:
                raise file.fail(f"names more than {MOST_LIBRARIES} material files")
            yield path, name
