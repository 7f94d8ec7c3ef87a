"""3MF: the 3D Manufacturing Format, a ZIP package with XML, meshes, colours and textures.

The specification has z up and a unit. File space has y up, and its unit is the millimetre, the format's default, so that files
in the default unit keep their numbers. The module's name begins with a digit, so that only importlib can import it.
"""

from __future__ import annotations

import io
import posixpath
import zipfile
from collections.abc import Iterator
from typing import Any
from urllib.parse import unquote

import numpy as np

from glshade.arrays import Float64, Int64
from glshade.errors import printable
from glshade.limits import MOST_INSTANCES
from glshade.mesh.mesh import Mesh
from glshade.mesh.reading.contents import EMBEDDED, Material
from glshade.mesh.reading.file import MeshFile, short
from glshade.mesh.reading.markup import parse
from glshade.mesh.reading.threemf import COLOURS, UVS, Model, Object, Placement, model

# The bytes that all parts which are read may have after unpacking. The XML of regular meshes shrinks to a thirtieth; a ZIP bomb
# shrinks to a thousandth. Small packages may shrink more, because the parts of XML that repeat weigh more in them.
_LEAST_UNPACKED, _MOST_RATIO = 64 << 20, 60
# The nesting of objects in objects.
_DEEPEST = 64
_CHUNK = 1 << 20
_Z_UP = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], dtype=np.float64)


def read(file: MeshFile) -> None:
    """Adds a part for each mesh, texture and place of the build of a 3MF package. Errors: AssetError."""
    package = _Package(file)
    start = package.start()
    first = package.model(start)
    scale = np.diag([first.scale, first.scale, first.scale, 1.0])
    items = first.build
    if not items:
        nested = {placed.object for item in first.objects.values() for placed in item.components if not placed.path}
        items = [Placement(number, "", np.eye(4)) for number in first.objects if number not in nested]
        file.warn("has nothing in its build; drawn with all its objects")
    builder = _Builder(file, package)
    for item in items:
        builder.add(item, start, _Z_UP @ scale, ())


class _Package:
    """The ZIP archive of a package, whose parts are read at most once each."""

    def __init__(self, file: MeshFile) -> None:
        """Errors: AssetError."""
        self._file = file
        try:
            self._archive = zipfile.ZipFile(io.BytesIO(file.data))
        except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError, UnicodeError):
            raise file.fail("is not a readable 3MF file: it is no ZIP archive, or it is truncated") from None
        # The names of parts do not depend on the case of letters (Open Packaging Conventions, ECMA-376 part 2).
        self._parts = {info.filename.lstrip("/").lower(): info for info in self._archive.infolist()}
        self._left = max(_LEAST_UNPACKED, _MOST_RATIO * len(file.data))
        self._models: dict[str, Model] = {}

    def start(self) -> str:
        """Returns the name of the part with the model that the package shows. Errors: AssetError."""
        targets: list[str] = []

        def collect(name: str, given: dict[str, str]) -> None:
            if name == "Relationship" and given.get("Type", "").endswith("/3dmodel"):
                targets.append(given["Target"])

        if self.has("_rels/.rels"):
            parse(self._file, "_rels/.rels, ", self._chunks("_rels/.rels"), collect)
        found = next((target for target in targets if self.has(target)), None)
        if found is None:
            found = next((name for name in self._parts if name.endswith(".model")), None)
        if found is None:
            raise self._file.fail("is not a readable 3MF file: the archive holds no model")
        return found

    def has(self, name: str) -> bool:
        """Returns whether the package has a part with this name."""
        return _plain(name) in self._parts

    def model(self, name: str) -> Model:
        """Returns the model in a part. Errors: AssetError."""
        key = _plain(name)
        if key not in self._models:
            if key not in self._parts:
                raise self._file.fail(f"has no part '{printable(short(name))}', which its model names")
            self._models[key] = model(self._file, printable(short(name.lstrip("/"))), self._chunks(name))
        return self._models[key]

    def read(self, name: str) -> bytes:
        """Returns the bytes of a part, which must exist. Errors: AssetError."""
        return b"".join(self._chunks(name))

    def _chunks(self, name: str) -> Iterator[bytes]:
        """Yields the bytes of a part in pieces. Errors: AssetError, before anything is unpacked if the part is too large."""
        info = self._parts[_plain(name)]
        quoted = printable(short(name))
        self._left -= info.file_size
        if self._left < 0:
            raise self._file.fail(f"part '{quoted}' has {info.file_size:,} bytes, far more than the file; is it a ZIP bomb?")
        if info.flag_bits & 1:
            raise self._file.fail(f"part '{quoted}' is encrypted; save it without a password")
        import lzma
        import zlib

        try:
            with self._archive.open(info) as stream:
                while chunk := stream.read(_CHUNK):
                    yield chunk
        except (
            zipfile.BadZipFile,
            zlib.error,
            lzma.LZMAError,
            EOFError,
            OSError,
            RuntimeError,
            NotImplementedError,
            ValueError,
        ):
            raise self._file.fail(f"part '{quoted}' cannot be unpacked: the archive is damaged") from None


def _plain(name: str) -> str:
    """Returns the key of a part: its name without escapes, a leading slash and capitals."""
    return posixpath.normpath(unquote(name)).lstrip("/").lower()


class _Builder:
    """Adds objects with all their components to the contents of a file, each mesh once."""

    def __init__(self, file: MeshFile, package: _Package) -> None:
        self._file, self._package = file, package
        # Part and id of an object -> the mesh, or its index in the contents, and the material of each of its parts.
        self._built: dict[tuple[str, int], list[tuple[Mesh | int, Material | None]]] = {}
        self._visited = 0
        self._pictures: dict[str, str] = {}

    def add(self, placed: Placement, part: str, parent: Float64, above: tuple[tuple[str, int], ...]) -> None:
        """Adds an object.

        part: the part of the package that names the object.
        parent: (4, 4), to file space.
        above: the objects that contain this one.
        Errors: AssetError.
        """
        path = placed.path or part
        key = _plain(path), placed.object
        source = self._package.model(path)
        item = source.objects.get(placed.object)
        if item is None:
            raise self._file.fail(f"object {placed.object}, which the model names, does not exist")
        if key in above or len(above) > _DEEPEST:
            wrong = "contains itself" if key in above else f"is nested more than {_DEEPEST} deep"
            raise self._file.fail(f"object {placed.object} {wrong}")
        self._visited += 1
        if self._visited > MOST_INSTANCES:
            raise self._file.fail(f"places more than {MOST_INSTANCES:,} objects")
        with np.errstate(all="ignore"):
            transform = parent @ placed.transform
        if not np.isfinite(transform).all():
            raise self._file.fail(f"object {placed.object} has a transform that is not finite")
        if len(item.triangles):
            if key not in self._built:
                self._built[key] = list(self._meshes(item, source, placed.object))
            contents, entries = self._file.contents, self._built[key]
            for index, (mesh, material) in enumerate(entries):
                contents.add(item.name or f"object {placed.object}", mesh, material, transform)
                entries[index] = contents.parts[-1]["mesh"], material
        for component in item.components:
            self.add(component, path, transform, (*above, key))

    def _meshes(self, item: Object, source: Model, number: int) -> Iterator[tuple[Mesh, Material | None]]:
        """Yields the mesh and the material of each texture of an object. Errors: AssetError."""
        positions, triangles, properties = item.arrays()
        wrong = (triangles < 0) | (triangles >= len(positions))
        if wrong.any():
            row = int(wrong.any(axis=1).argmax())
            vertex = triangles[row][wrong[row]][0]
            place = f"object {number}, triangle {row:,}"
            raise self._file.fail(f"{place}: vertex {vertex} is out of range: the object has {len(positions):,}")
        colours, uvs, textures = self._properties(source, properties)
        parts: list[dict[str, Any]] = []
        found = np.unique(textures).tolist()
        plain = colours is None and uvs is None
        for texture in found:
            rows = textures == texture
            corners = triangles[rows].reshape(-1)
            used, local = np.unique(corners, return_inverse=True) if plain else (corners, np.arange(len(corners)))
            parts.append(
                {
                    "positions": positions[used],
                    "triangles": local.reshape(-1, 3),
                    "colours": None if colours is None else colours[rows].reshape(-1, 4),
                    "uvs": None if uvs is None or texture < 0 else uvs[rows].reshape(-1, 2),
                }
            )
        for mesh, texture in zip(self._file.build_surface(f"object {number}: ", parts), found, strict=True):
            if mesh is not None:
                yield mesh, self._material(source, texture)

    def _properties(self, source: Model, properties: Int64) -> tuple[Float64 | None, Float64 | None, Int64]:
        """Returns the colours (T, 3, 4) and the uvs (T, 3, 2) of triangles' corners, and the ids (T,) of their textures.

        properties: (T, 4), the group of each triangle and three indices in it; a negative group stands for none.
        The colours and the uvs are None where no triangle has any. The id is -1 for no texture.
        """
        colours, uvs = np.ones((len(properties), 3, 4)), np.zeros((len(properties), 3, 2))
        textures = np.full(len(properties), -1, dtype=np.int64)
        coloured = False
        for number in np.unique(properties[:, 0]).tolist():
            group = source.groups.get(number)
            if number < 0:
                continue
            if group is None or group.kind not in (*COLOURS, UVS):
                kind = "a group of properties that does not exist" if group is None else group.kind
                self._file.warn(f"some triangles have {kind}, which is not read; drawn plain")
                continue
            values = group.uvs if group.kind == UVS else group.colours
            rows = np.flatnonzero(properties[:, 0] == number)
            indices = properties[rows, 1:]
            fits = ((indices >= 0) & (indices < len(values))).all(axis=1)
            if not fits.all():
                self._file.warn(f"{int(np.sum(~fits)):,} triangles have properties that do not exist; drawn plain")
            rows, indices = rows[fits], indices[fits]
            if group.kind == UVS:
                uvs[rows], textures[rows] = values[indices], group.texture
            else:
                colours[rows], coloured = values[indices], True
        return colours if coloured else None, uvs if (textures >= 0).any() else None, textures

    def _material(self, source: Model, number: int) -> Material | None:
        """Returns the material that shows a texture; None, with a warning, where its picture is missing."""
        if number < 0:
            return None
        texture = source.textures.get(number)
        if texture is None or not self._package.has(texture.path):
            self._file.warn(f"texture {number} is not in the package; drawn without it")
            return None
        if texture.path not in self._pictures:
            suffix = posixpath.splitext(texture.path)[1].lower()
            name = f"image{len(self._pictures)}{suffix if suffix in ('.png', '.jpg', '.jpeg') else '.image'}"
            self._file.contents.images[name] = self._package.read(texture.path)
            self._pictures[texture.path] = EMBEDDED + name
        kd = {"texture": self._pictures[texture.path], "factor": [1.0, 1.0, 1.0], "wrap": texture.wrap}
        return {"brdf": "lambert", "kd": kd}
