"""Reads mesh files (OBJ with MTL, PLY, STL, OFF, glTF) and keeps what it read in the user's cache folder.

The geometry is parsed by trimesh's loaders, called below the level at which it builds its own objects: those merge
vertices, recompute normals and turn colours into bytes. Importing trimesh takes more than half a second, so it
happens only when a file is new; an entry of the cache holds the arrays, the materials and what they depend on.
"""

from __future__ import annotations

import atexit
import base64
import hashlib
import io
import json
import logging
import os
import re
import shutil
import struct
import tempfile
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, TypeAlias
from urllib.parse import unquote

import numpy as np
import numpy.typing as npt

from glshade.errors import AssetError
from glshade.mesh import Array, Float64, Mesh, in_local_order

# Raise it when the same file would be read differently: entries of older loaders are then never looked at.
LOADER_VERSION = 2

# Above this many triangles a mesh no longer fits the caches and its order begins to count.
ORDERED_ABOVE = 1000

# Marks a texture that is a file of the cache entry itself: `embedded:NAME`.
EMBEDDED = "embedded:"

Material: TypeAlias = dict[str, Any]


class AssetWarning(UserWarning):
    """Something a mesh file names is missing or not used; the mesh is drawn without it."""


@dataclass(frozen=True, eq=False)
class Part:
    """One mesh of a file, where the file puts it.

    transform: (4, 4) float64, object to file space, all nested transforms multiplied.
    material: in the scene file's form, or None where the file has none. Colours are linear Rec. 709 factors.
    """

    name: str
    mesh: Mesh
    transform: Float64
    material: Material | None


@dataclass(frozen=True, eq=False)
class Model:
    """All parts of a mesh file; parts that instance one mesh share the Mesh object."""

    parts: tuple[Part, ...]


def load(path: Path) -> Model:
    """The model in a mesh file, from memory or from the cache where the file and what it depends on are unchanged.

    Raises AssetError, one line starting with the path: missing, unreadable, broken, or nothing in it to draw.
    Warns with AssetWarning where a material file or a texture is missing.
    """
    path = Path(path)
    if path.suffix.lower() not in _READERS:
        raise AssetError(f"{path}: unknown kind of mesh file; supported are {', '.join(sorted(_READERS))}")
    full = Path(os.path.abspath(path))  # not resolved: a link's textures lie beside the link, as its writer saw them
    try:
        if path.is_dir():
            raise AssetError(f"{path}: is a folder, not a mesh file")
        stat = path.stat()
        remembered = _memory.get(full)
        if remembered and remembered.stamps == _stamps(remembered.stamps):
            return remembered.model
        data = path.read_bytes()
    except FileNotFoundError:
        raise AssetError(f"{path}: no such file") from None
    except OSError as error:
        raise AssetError(f"{path}: cannot be read: {error.strerror}") from None
    if not data.strip():
        raise AssetError(f"{path}: is empty")

    key = hashlib.sha256(f"{LOADER_VERSION}\0{full}\0".encode() + data).hexdigest()[:32]
    folder = _cache_folder() / key
    loaded = _recall(folder)
    if loaded is None:
        loaded = _read(path, full, data)
        folder = _keep(loaded, folder)
    for line in loaded.warnings:
        warnings.warn(line, AssetWarning, stacklevel=2)
    model = _model(loaded, folder)
    stamps = {full: (stat.st_mtime_ns, stat.st_size)} | _stamps(loaded.dependencies)
    _memory[full] = _Remembered(model, stamps)
    return model


Stamp: TypeAlias = tuple[int, int] | None


@dataclass(frozen=True)
class _Remembered:
    model: Model
    stamps: dict[Path, Stamp]


_memory: dict[Path, _Remembered] = {}


def _stamps(paths: Any) -> dict[Path, Stamp]:
    """Time and size of each file, None where there is none: equal stamps, equal contents, as far as one can see."""

    def stamp(path: Path) -> Stamp:
        try:
            stat = path.stat()
        except OSError:
            return None
        return stat.st_mtime_ns, stat.st_size

    return {Path(path): stamp(Path(path)) for path in paths}


@dataclass
class _Loaded:
    """What a file held, in the form in which the cache keeps it."""

    meshes: list[Mesh] = field(default_factory=list)
    # Each: name, mesh (an index), transform (rows), material.
    parts: list[dict[str, Any]] = field(default_factory=list)
    images: dict[str, bytes] = field(default_factory=dict)
    # File -> sha256 of its bytes, "present" where only its presence counts, None where it was missing.
    dependencies: dict[str, str | None] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)

    def add(self, name: str, mesh: Mesh | int, material: Material | None = None, transform: Float64 | None = None) -> None:
        """Add a part; a mesh already added is given by its index."""
        if isinstance(mesh, Mesh):
            self.meshes.append(in_local_order(mesh) if len(mesh.triangles) > ORDERED_ABOVE else mesh)
            mesh = len(self.meshes) - 1
        taken = {part["name"] for part in self.parts}
        unique, count = name, 1
        while unique in taken:
            count += 1
            unique = f"{name}.{count}"
        rows = (np.eye(4) if transform is None else transform).tolist()
        self.parts.append({"name": unique, "mesh": mesh, "transform": rows, "material": material})


# --- cache -----------------------------------------------------------------------------------------------------------


def _cache_folder() -> Path:
    base = os.environ.get("XDG_CACHE_HOME")
    return Path(base or os.path.expanduser("~/.cache")) / "glshade" / "meshes"


def _recall(folder: Path) -> _Loaded | None:
    """The cache's entry, or None where there is none, it is damaged, or what it depends on has changed."""
    try:
        stored = json.loads((folder / "entry.json").read_bytes())
        loaded = _Loaded(parts=stored["parts"], dependencies=stored["dependencies"], warnings=stored["warnings"])
        if any(_state(Path(file), state) != state for file, state in loaded.dependencies.items()):
            return None
        for index, names in enumerate(stored["meshes"]):
            arrays = {name: np.load(folder / f"{index}.{name}.npy", allow_pickle=False) for name in names}
            loaded.meshes.append(Mesh(**arrays))
        if not all((folder / name).is_file() for name in stored["images"]):
            return None
        _model(loaded, folder)  # refuses indices and transforms that cannot be
    except Exception:  # whatever is wrong with an entry, the file itself is still there to read
        return None
    return loaded


def _keep(loaded: _Loaded, folder: Path) -> Path:
    """Write the entry and return where it lies; where the cache cannot be written, its images go to a folder that
    lasts as long as the process."""
    partial: Path | None = None
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        partial = Path(tempfile.mkdtemp(prefix=f"{folder.name}.", dir=folder.parent))
        names = []
        for index, mesh in enumerate(loaded.meshes):
            arrays = {f.name: getattr(mesh, f.name) for f in fields(mesh) if getattr(mesh, f.name) is not None}
            for name, array in arrays.items():
                np.save(partial / f"{index}.{name}.npy", array)
            names.append(list(arrays))
        _write_images(loaded, partial)
        entry = {
            "meshes": names,
            "parts": loaded.parts,
            "images": list(loaded.images),
            "dependencies": loaded.dependencies,
            "warnings": loaded.warnings,
        }
        (partial / "entry.json").write_text(json.dumps(entry))
        try:
            partial.rename(folder)
        except OSError:
            # There is an entry already: another process wrote it just now, from the same bytes, or it is outdated.
            if _recall(folder) is None:
                shutil.rmtree(folder, ignore_errors=True)
                partial.rename(folder)
            else:
                shutil.rmtree(partial, ignore_errors=True)
        return folder
    except OSError:
        if partial is not None:
            shutil.rmtree(partial, ignore_errors=True)
    if loaded.images:
        folder = Path(tempfile.mkdtemp(prefix="glshade-"))
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        _write_images(loaded, folder)
    return folder


def _write_images(loaded: _Loaded, folder: Path) -> None:
    for name, data in loaded.images.items():
        (folder / name).write_bytes(data)


def _state(path: Path, like: str | None) -> str | None:
    """The dependency's state now, in the same terms as the state recorded."""
    if not path.is_file():
        return None
    return "present" if like == "present" else hashlib.sha256(path.read_bytes()).hexdigest()


def _model(loaded: _Loaded, folder: Path) -> Model:
    def place(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: place(item) for key, item in value.items()}
        if isinstance(value, str) and value.startswith(EMBEDDED):
            return str(folder / value.removeprefix(EMBEDDED))
        return value

    parts = []
    for part in loaded.parts:
        transform = np.array(part["transform"], dtype=np.float64).reshape(4, 4)
        transform.flags.writeable = False
        parts.append(Part(part["name"], loaded.meshes[part["mesh"]], transform, place(part["material"])))
    return Model(tuple(parts))


# --- reading ---------------------------------------------------------------------------------------------------------


@dataclass
class _File:
    """The file being read, what it needed on the way, and what came of it."""

    path: Path  # as the user wrote it, for messages
    folder: Path
    data: bytes
    loaded: _Loaded = field(default_factory=_Loaded)

    def fail(self, message: str) -> AssetError:
        return AssetError(f"{self.path}: {' '.join(message.split())}")

    def warn(self, message: str) -> None:
        line = f"{self.path}: {' '.join(message.split())}"
        if line not in self.loaded.warnings:
            self.loaded.warnings.append(line)

    def beside(self, name: str) -> Path:
        """The file of that name, which another system may have written: with backslashes, a folder that is not
        here, or letters of the other case."""
        name = name.replace("\\", "/")
        exact = self.folder / name
        if exact.is_file():
            return exact
        for folder in (exact.parent, self.folder):
            if folder.is_dir():
                for found in sorted(folder.iterdir()):
                    if found.name.lower() == exact.name.lower() and found.is_file():
                        return found
        return exact

    def read(self, path: Path) -> bytes | None:
        """The bytes of a file this one depends on, None where it is missing."""
        try:
            data = path.read_bytes()
        except OSError:
            self.loaded.dependencies[str(path)] = None
            return None
        self.loaded.dependencies[str(path)] = hashlib.sha256(data).hexdigest()
        return data

    def texture(self, name: str) -> str | None:
        """The absolute path of a texture, None (with a warning) where it is missing."""
        path = self.beside(name)
        found = path.is_file()
        self.loaded.dependencies[str(path)] = "present" if found else None
        if not found:
            self.warn(f"texture '{name}' not found; drawn without it")
        return str(path) if found else None

    def build(self, where: str, *arrays: Any, **named: Any) -> Mesh:
        try:
            return Mesh.build(*arrays, **named)
        except AssetError as error:
            raise self.fail(f"{where}{error}") from None


def _read(path: Path, full: Path, data: bytes) -> _Loaded:
    suffix = path.suffix.lower()
    file = _File(path, full.parent, data)
    try:
        with _quiet():
            _READERS[suffix](file)
    except AssetError:
        raise
    except Exception as error:  # a parser fails in any way on garbage; the user is told which file, in one line
        detail = f"{type(error).__name__}: {error}".rstrip(": ")
        raise file.fail(f"not a readable {suffix[1:].upper()} file ({detail[:200]})") from error
    if not file.loaded.parts:
        raise file.fail("holds no triangles")
    return file.loaded


@contextmanager
def _quiet() -> Iterator[None]:
    """Neither warnings nor log lines of the parsers: what matters of them is said in our own words."""
    logger = logging.getLogger("trimesh")
    level = logger.level
    logger.setLevel(logging.CRITICAL + 1)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        logger.setLevel(level)


def _parsed(file: _File, kind: str, data: bytes, **options: Any) -> dict[str, Any]:
    """What trimesh's loader makes of the bytes: the keyword arguments for its own constructors."""
    from trimesh.exchange.load import mesh_loaders

    loaders: dict[str, Any] = mesh_loaders
    result: dict[str, Any] = loaders[kind](io.BytesIO(data), file_type=kind, **options)
    return result


def _triangles(faces: Any) -> Array:
    """(T, 3) integers from triangles, quads or a mixture with polygons."""
    from trimesh.geometry import triangulate_quads

    return np.asarray(triangulate_quads(faces)).reshape(-1, 3)


def _srgb_to_linear(x: Float64) -> Float64:
    """IEC 61966-2-1."""
    return np.where(x <= 0.04045, x / 12.92, ((np.maximum(x, 0.0) + 0.055) / 1.055) ** 2.4)


def _with_alpha(colours: Float64) -> Float64:
    return np.column_stack([colours, np.ones(len(colours))]) if colours.shape[1] == 3 else colours[:, :4]


# --- PLY, STL, OFF ---------------------------------------------------------------------------------------------------


def _read_ply(file: _File) -> None:
    # fix_texture would renumber the vertices but not their normals and colours.
    parsed = _parsed(file, "ply", file.data, skip_materials=True, fix_texture=False)
    if "vertices" not in parsed:
        raise file.fail("holds no vertices")
    if parsed.get("faces") is None or len(parsed["faces"]) == 0:
        raise file.fail("holds only points, no triangles")
    vertex = parsed["metadata"]["_ply_raw"]["vertex"]["data"]
    positions, normals, colours = parsed["vertices"], parsed.get("vertex_normals"), None
    if parsed.get("vertex_colors") is not None:
        raw = np.asarray(parsed["vertex_colors"])
        colours = raw / np.iinfo(raw.dtype).max if raw.dtype.kind == "u" else raw.astype(np.float64)
        colours = _with_alpha(colours)
        if raw.dtype.itemsize == 1:  # bytes are sRGB-encoded by custom; wider types are taken as linear
            colours[:, :3] = _srgb_to_linear(colours[:, :3])
    has = set(vertex.dtype.names if isinstance(vertex, np.ndarray) else vertex)
    uvs = None
    for u, v in (("s", "t"), ("u", "v"), ("texture_u", "texture_v")):
        if {u, v} <= has:
            uvs = np.column_stack([vertex[u], vertex[v]])
    faces = parsed["faces"]
    per_face = _ply_face_uvs(parsed["metadata"]["_ply_raw"]["face"]["data"], np.shape(faces))
    if per_face is not None:
        corners = np.reshape(faces, -1)
        if corners.min() < 0 or corners.max() >= len(positions):
            raise file.fail(f"a face index is out of range: the mesh has {len(positions)} vertices")
        positions, uvs = positions[corners], per_face
        normals = None if normals is None else normals[corners]
        colours = None if colours is None else colours[corners]
        faces = np.arange(len(corners)).reshape(np.shape(faces))
    picture = re.search(rb"^comment\s+TextureFile\s+(.+?)\s*$", file.data[:4096], re.MULTILINE)
    material: Material | None = None
    if picture and uvs is not None:
        texture = file.texture(picture[1].decode("utf-8", "replace"))
        if texture:
            material = {"brdf": "lambert", "kd": {"texture": texture, "factor": [1.0, 1.0, 1.0]}}
    mesh = file.build("", positions, _triangles(faces), normals=normals, uvs=uvs, colours=colours)
    file.loaded.add(file.path.stem, mesh, material)


def _ply_face_uvs(data: Any, shape: tuple[int, ...]) -> Float64 | None:
    """(corners, 2) from a face property `texcoord`, in the two forms in which trimesh leaves it."""
    try:
        raw = data["texcoord"]
        if isinstance(data, np.ndarray):
            raw = raw["f1"]
        uvs = np.asarray(raw, dtype=np.float64)
    except (KeyError, ValueError, IndexError, TypeError):
        return None
    return uvs.reshape(-1, 2) if len(shape) == 2 and uvs.shape == (shape[0], 2 * shape[1]) else None


def _read_plain(file: _File) -> None:
    """STL and OFF. STL's normals belong to faces and follow from them; they are not read."""
    parsed = _parsed(file, file.path.suffix[1:].lower(), file.data)
    geometries = parsed.get("geometry") or {file.path.stem: parsed}
    for name, geometry in geometries.items():
        if len(geometry.get("vertices", ())) and not len(geometry.get("faces", ())):
            raise file.fail("holds only points, no triangles")
        if len(geometry.get("faces", ())):
            mesh = file.build("", geometry["vertices"], _triangles(geometry["faces"]))
            file.loaded.add(name or file.path.stem, mesh)


# --- OBJ and MTL -----------------------------------------------------------------------------------------------------


@dataclass
class _Faces:
    """Faces of one object, one material and one form of corner (v, v/vt, v//vn or v/vt/vn)."""

    lines: list[str] = field(default_factory=list)
    numbers: list[int] = field(default_factory=list)  # of the line in the file, for messages


_FORMS = {(0, 0): "v", (3, 0): "v/vt", (6, 3): "v//vn", (6, 0): "v/vt/vn"}


def _read_obj(file: _File) -> None:
    text = _text(file.data).replace("\\\n", " ")
    attributes: dict[str, list[str]] = {"v": [], "vt": [], "vn": []}
    groups: dict[tuple[str, str | None, str], _Faces] = {}
    libraries: list[str] = []
    name, material = "", None
    for number, line in enumerate(text.split("\n"), 1):
        word, _, rest = line.strip().replace("\t", " ").partition(" ")
        if word in attributes:
            attributes[word].append(rest.partition("#")[0])
        elif word == "f":
            for form, corners in _obj_faces(file, number, rest.partition("#")[0].strip(), attributes):
                faces = groups.setdefault((name, material, form), _Faces())
                faces.lines.append(corners)
                faces.numbers.append(number)
        elif word == "usemtl":
            material = rest.strip()
        elif word == "o":
            name = rest.strip()
        elif word == "mtllib":
            libraries.append(rest.strip())
    if not attributes["v"]:
        raise file.fail("holds no vertices" if groups else "holds no vertices: not an OBJ file?")
    if not groups:
        raise file.fail("holds only points, no triangles")
    groups = _obj_in_range(file, attributes, groups)

    # trimesh reads the text in its strictest form: triangles, absolute indices, one form of corner in each object. Its
    # parser counts negative indices from the end of the file and takes the form of all faces from the first.
    strict = [f"{key} {line}" for key, lines in attributes.items() for line in lines]
    for index, faces in enumerate(groups.values()):
        strict.append(f"o {index}")
        strict += [f"f {line}" for line in faces.lines]
    options = {"skip_materials": True, "group_material": False, "split_objects": True}
    geometries = _parsed(file, "obj", "\n".join(strict).encode(), **options)["geometry"]
    materials = _materials_of(file, libraries) if any(key[1] for key in groups) else {}

    several_materials = len({key[:2] for key in groups}) > len({key[0] for key in groups})
    for index, (name, material, form) in enumerate(groups):
        geometry = geometries[str(index)]
        title = name or (material if several_materials else "") or file.path.stem
        if name and several_materials and material:
            title = f"{name}.{material}"
        colours = None
        if geometry.get("vertex_colors") is not None:
            raw = np.asarray(geometry["vertex_colors"], dtype=np.float64)
            raw = raw / 255 if raw.max() > 1 else raw
            colours = _with_alpha(_srgb_to_linear(raw))  # programs write their encoded bytes here, divided by 255
        if material and materials and material not in materials:
            file.warn(f"material '{material}' is in no material file; drawn without it")
        mesh = file.build(
            "",
            geometry["vertices"],
            _triangles(geometry["faces"]),
            normals=geometry.get("vertex_normals") if "vn" in form else None,
            uvs=geometry["visual"].uv if "vt" in form else None,
            colours=colours,
        )
        file.loaded.add(title, mesh, materials.get(material) if material else None)


def _text(data: bytes) -> str:
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _obj_faces(file: _File, number: int, corners: str, attributes: dict[str, list[str]]) -> Iterator[tuple[str, str]]:
    """The form and the corners of each triangle of a face line, indices counted from the file's start."""
    if corners.count(" ") == 2 and "-" not in corners and "/ " not in corners and corners[-1] != "/":
        form = _FORMS.get((corners.count("/"), corners.count("//")))
        if form is not None:
            yield form, corners
            return
    tokens = corners.split()
    if len(tokens) < 3:
        raise file.fail(f"line {number}: a face needs three corners: 'f {corners}'")
    counts = [len(attributes[key]) for key in ("v", "vt", "vn")]
    resolved = []
    for token in tokens:
        try:
            given = [int(part) if part else 0 for part in token.split("/")]
        except ValueError:
            raise file.fail(f"line {number}: '{token}' is not a corner of a face") from None
        given = [index + count + 1 if index < 0 else index for index, count in zip(given, counts, strict=False)]
        if min(given) < 0 or given[0] == 0:
            raise file.fail(f"line {number}: face index out of range in '{token}'")
        resolved.append([*given, 0, 0][:3])
    has_uv, has_normal = all(r[1] for r in resolved), all(r[2] for r in resolved)
    form = "v/vt/vn" if has_uv and has_normal else "v/vt" if has_uv else "v//vn" if has_normal else "v"
    written = {
        "v": "{0}",
        "v/vt": "{0}/{1}",
        "v//vn": "{0}//{2}",
        "v/vt/vn": "{0}/{1}/{2}",
    }[form]
    texts = [written.format(*r) for r in resolved]
    order = [(0, 1, 2)]
    if len(tokens) > 3:
        outline: Float64 | None = None
        if max(r[0] for r in resolved) <= counts[0]:
            outline = np.array([attributes["v"][r[0] - 1].split()[:3] for r in resolved], dtype=np.float64)
        order = triangulated(outline) if outline is not None else [(0, k, k + 1) for k in range(1, len(tokens) - 1)]
    for a, b, c in order:
        yield form, f"{texts[a]} {texts[b]} {texts[c]}"


def triangulated(outline: npt.ArrayLike) -> list[tuple[int, int, int]]:
    """Triangles (corners' numbers) of a simple, nearly plane polygon (N, 3), convex or not, in its own sense.

    A convex one becomes a fan round its first corner; of others, ears are cut (Meisters 1975).
    """
    p = np.asarray(outline, dtype=np.float64)
    count = len(p)
    fan = [(0, k, k + 1) for k in range(1, count - 1)]
    following = np.roll(p, -1, axis=0)
    normal = np.cross(p - p[0], following - p[0]).sum(axis=0)  # twice the area, whatever the outline's shape (Newell)
    if not np.isfinite(p).all() or not normal.any():
        return fan
    drop = int(np.abs(normal).argmax())
    keep = [[1, 2], [2, 0], [0, 1]][drop]
    flat = (p[:, keep] * [1.0, np.sign(normal[drop])]).tolist()  # counter-clockwise in two dimensions

    def turn(a: int, b: int, c: int) -> float:
        (ax, ay), (bx, by), (cx, cy) = flat[a], flat[b], flat[c]
        return float((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))

    if all(turn(k - 1, k, (k + 1) % count) >= 0 for k in range(count)):
        return fan
    left = list(range(count))
    ears = []
    while len(left) > 3:
        for k in range(len(left)):
            a, b, c = left[k - 1], left[k], left[(k + 1) % len(left)]
            if turn(a, b, c) > 0 and not any(
                turn(a, b, x) >= 0 and turn(b, c, x) >= 0 and turn(c, a, x) >= 0 for x in left if x not in (a, b, c)
            ):
                break
        else:
            k = 0  # the outline crosses itself: any triangle is as good as another
            a, b, c = left[-1], left[0], left[1]
        ears.append((a, b, c))
        del left[k]
    return [*ears, (left[0], left[1], left[2])]


def _obj_in_range(
    file: _File, attributes: dict[str, list[str]], groups: dict[tuple[str, str | None, str], _Faces]
) -> dict[tuple[str, str | None, str], _Faces]:
    """The groups, with references to uvs and normals that the file lacks taken out (warned of).

    Raises AssetError, with the line's number, for a vertex that the file lacks.
    """
    result: dict[tuple[str, str | None, str], _Faces] = {}
    for (name, material, form), faces in groups.items():
        kinds = [kind for kind in form.split("/") if kind]
        try:
            flat = np.fromstring(" ".join(faces.lines).replace("/", " "), dtype=np.int64, sep=" ")
            table = flat.reshape(len(faces.lines), 3, len(kinds))
        except ValueError:
            numbered = zip(faces.numbers, faces.lines, strict=True)
            number, line = next((n, x) for n, x in numbered if not re.fullmatch(r"[\d/ ]+", x))
            raise file.fail(f"line {number}: 'f {line}' is not a face") from None
        for column, kind in enumerate(kinds):
            indices = table[:, :, column]
            wrong = ((indices < 1) | (indices > len(attributes[kind]))).any(axis=1)
            if not wrong.any():
                continue
            first = int(wrong.argmax())
            message = f"line {faces.numbers[first]}: '{kind}' index out of range: the file has {len(attributes[kind])}"
            if kind == "v":
                raise file.fail(message)
            file.warn(f"{message}; drawn without {'texture coordinates' if kind == 'vt' else 'normals'} there")
            form = {"v/vt": "v", "v//vn": "v", "v/vt/vn": "v//vn" if kind == "vt" else "v/vt"}[form]
        if form == "/".join(kinds) or (form == "v//vn" and kinds == ["v", "vn"]):
            lines = faces.lines
        else:
            left = [kinds.index(kind) for kind in form.split("/") if kind]
            glue = "//" if form == "v//vn" else "/"
            lines = [" ".join(glue.join(str(corner[k]) for k in left) for corner in row) for row in table.tolist()]
        merged = result.setdefault((name, material, form), _Faces())
        merged.lines += lines
        merged.numbers += faces.numbers
    return result


def _materials_of(file: _File, libraries: list[str]) -> dict[str, Material]:
    materials: dict[str, Material] = {}
    for line in libraries:
        # The whole line may be one name with spaces, or several names.
        names = [line] if file.beside(line).is_file() else line.split()
        for name in names:
            data = file.read(file.beside(name))
            if data is None:
                file.warn(f"material file '{name}' not found; drawn without its materials")
            else:
                materials = _mtl(file, _text(data)) | materials
    return materials


def _mtl(file: _File, text: str) -> dict[str, Material]:
    """Materials by name, in the scene file's form."""
    statements: dict[str, dict[str, str]] = {}
    current: dict[str, str] = {}
    for line in text.split("\n"):
        word, _, rest = line.strip().replace("\t", " ").partition(" ")
        if word.lower() == "newmtl":
            current = statements[rest.strip()] = {}
        elif word and not word.startswith("#"):
            current[word.lower()] = rest.strip()
    return {name: _mtl_material(file, name, given) for name, given in statements.items()}


def _mtl_material(file: _File, name: str, given: dict[str, str]) -> Material:
    def numbers(key: str) -> list[float] | None:
        try:
            values = [float(x) for x in given[key].split("#")[0].split()]
        except KeyError:
            return None
        except ValueError:
            file.warn(f"material '{name}': '{key} {given[key]}' is not a number; left out")
            return None
        return values or None

    def colour(key: str) -> list[float] | None:
        values = numbers(key)
        return None if values is None else values[:3] if len(values) >= 3 else values[:1] * 3

    kd: Any = colour("kd")
    if "map_kd" in given:
        texture, wrap = _map_statement(file, given["map_kd"])
        if texture:
            # Many exporters leave Kd at 0 beside a map; taken as a factor it would turn the picture black.
            kd = {"texture": texture, "factor": kd if kd and any(kd) else [1.0, 1.0, 1.0]} | wrap
    # 0.8: what the format's own viewers showed where a material states no Kd.
    material: Material = {"brdf": "lambert", "kd": [0.8, 0.8, 0.8] if kd is None else kd}
    ks = colour("ks")
    # The format defines Ks and Ns with the reflection vector (illum 2): Phong, not Blinn-Phong. illum 0 and 1 have no
    # highlight, and neither has Ns 0: programs write it for "none", where the formula would give all of Ks everywhere.
    exponent = (numbers("ns") or [1.0])[0]
    if ks and any(ks) and exponent > 0 and (numbers("illum") or [2.0])[0] >= 2:
        material |= {"brdf": "phong", "ks": ks, "exponent": exponent}
    ka = colour("ka")
    if ka:
        # Lambert reflects ambient light with kd; a ka of its own makes it a Phong without a highlight.
        material = {"ks": [0.0, 0.0, 0.0]} | material | {"brdf": "phong", "ka": ka}
    if "norm" in given:
        texture, wrap = _map_statement(file, given["norm"])
        if texture:
            material["normal_map"] = {"texture": texture} | wrap
    # Tr is 1 - d, but some programs write opacity there. Nobody writes a material that cannot be seen, so 1 is theirs
    # and means opaque.
    tr = (numbers("tr") or [0.0])[0]
    alpha = (numbers("d") or [1.0 if tr == 1 else 1 - tr])[0]
    if alpha < 1:
        material |= {"alpha": alpha, "alpha_mode": "blend"}
    return material


# Options of a texture statement and how many words they take; of -o, -s and -t the last two may be missing.
_MAP_OPTIONS = {
    "-blendu": 1, "-blendv": 1, "-bm": 1, "-boost": 1, "-cc": 1, "-clamp": 1, "-imfchan": 1, "-mm": 2, "-texres": 1,
    "-o": 3, "-s": 3, "-t": 3,
}  # fmt: skip


def _map_statement(file: _File, statement: str) -> tuple[str | None, dict[str, list[str]]]:
    """The texture's path (None if missing) and its wrap mode; names may hold spaces."""
    wrap = {}
    while statement.startswith("-") and statement.split()[0].lower() in _MAP_OPTIONS:
        option, *words = statement.split()
        taken = _MAP_OPTIONS[option.lower()]
        if option.lower() in ("-o", "-s", "-t"):
            taken = next((k for k, word in enumerate(words[:3]) if not re.fullmatch(r"[-+.\deE]+", word)), 3)
        if option.lower() == "-clamp" and words[:1] == ["on"]:
            wrap = {"wrap": ["clamp", "clamp"]}
        statement = statement.split(None, taken + 1)[-1] if len(words) > taken else ""
    return (file.texture(statement) if statement else None), wrap


# --- glTF ------------------------------------------------------------------------------------------------------------

_TRIANGLES, _STRIP = 4, 5
_WRAP = {33071: "clamp", 33648: "mirror", 10497: "repeat"}
_COMPRESSED = ("KHR_draco_mesh_compression", "EXT_meshopt_compression")
_SIZES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}


def _read_gltf(file: _File) -> None:
    header, buffers = _gltf_header(file)
    for extension in header.get("extensionsRequired", ()):
        if extension in _COMPRESSED:
            raise file.fail(f"needs the glTF extension {extension}, which is not supported; save it uncompressed")
    accessors = header.get("accessors", [])

    # Only triangles are handed to trimesh, under names by which what it returns can be told apart; its scene graph
    # loses the children of cameras, so nodes are walked here. Attributes that start with _ come back as they are.
    kept: list[tuple[int, dict[str, Any]]] = []
    others = 0
    meshes = []
    for number, mesh in enumerate(header.get("meshes", [])):
        primitives = []
        for primitive in mesh["primitives"]:
            if primitive.get("mode", _TRIANGLES) not in (_TRIANGLES, _STRIP):
                others += 1
                continue
            attributes = {key: value for key, value in primitive["attributes"].items() if key in ("POSITION", "NORMAL")}
            uv_set = f"TEXCOORD_{_gltf_uv_set(header, primitive)}"
            for key, source in (("_UV", uv_set), ("_COLOUR", "COLOR_0")):
                if source in primitive["attributes"]:
                    attributes[key] = primitive["attributes"][source]
            used = [*attributes.values(), *([primitive["indices"]] if "indices" in primitive else [])]
            for index in used:
                if "sparse" in accessors[index]:
                    raise file.fail(f"accessor {index} is sparse, which is not supported; save it plain")
            entry = {key: value for key, value in primitive.items() if key in ("indices", "mode", "material")}
            primitives.append(entry | {"attributes": attributes})
            kept.append((number, primitives[-1]))
        meshes.append({"name": f"{number}", "primitives": primitives})
    if not kept:
        raise file.fail("holds only points or lines, no triangles" if others else "holds no triangles")
    plain = {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": str(index), "byteLength": len(data)} for index, data in enumerate(buffers)],
        "bufferViews": header.get("bufferViews", []),
        "accessors": [{k: v for k, v in accessor.items() if k != "sparse"} for accessor in accessors],
        "meshes": meshes,
    }
    resolver = {str(index): data for index, data in enumerate(buffers)}
    parsed = _parsed(file, "gltf", json.dumps(plain).encode(), resolver=resolver, skip_materials=True)
    geometries = list(parsed["geometry"].values())
    assert len(geometries) == len(kept)

    def values(raw: Any, accessor: int) -> Float64:
        """As floats; integers marked as normalized are fractions of their range (glTF 2.0, 3.6.2.2)."""
        raw = np.asarray(raw)
        if raw.dtype.kind == "f" or not accessors[accessor].get("normalized", False):
            return np.array(raw, dtype=np.float64)
        fractions: Float64 = np.maximum(raw / np.iinfo(raw.dtype).max, -1.0)
        return fractions

    built: dict[int, list[tuple[Mesh, Material | None]]] = {}
    materials: dict[int, Material] = {}
    for (number, primitive), geometry in zip(kept, geometries, strict=True):
        attributes = primitive["attributes"]
        extra = geometry.get("vertex_attributes", {})
        uvs = colours = normals = None
        if "_UV" in attributes:
            uvs = values(extra["_UV"], attributes["_UV"])
            uvs[:, 1] = 1 - uvs[:, 1]  # glTF has v = 0 at the top of the picture
        if "_COLOUR" in attributes:
            colours = _with_alpha(values(extra["_COLOUR"], attributes["_COLOUR"]))  # linear already (glTF 2.0, 3.7.2.1)
        if "NORMAL" in attributes:
            normals = values(geometry["vertex_normals"], attributes["NORMAL"])
        positions = values(geometry["vertices"], attributes["POSITION"])
        where = f"mesh {number}: "
        mesh = file.build(where, positions, np.asarray(geometry["faces"]), normals=normals, uvs=uvs, colours=colours)
        material = None
        if "material" in primitive:
            index = primitive["material"]
            if index not in materials:
                materials[index] = _gltf_material(file, header, buffers, header["materials"][index])
            material = materials[index]
        built.setdefault(number, []).append((mesh, material))

    stored: dict[int, int] = {}
    for name, number, transform in _gltf_nodes(file, header):
        for index, (mesh, material) in enumerate(built.get(number, [])):
            title = name or header["meshes"][number].get("name") or f"mesh {number}"
            if len(built[number]) > 1:
                title = f"{title}.{index + 1}"
            known = stored.get(id(mesh))
            file.loaded.add(title, mesh if known is None else known, material, transform)
            stored.setdefault(id(mesh), len(file.loaded.meshes) - 1)


def _gltf_header(file: _File) -> tuple[dict[str, Any], list[bytes]]:
    """The JSON part, checked for its version, and the bytes of every buffer."""
    data, binary = file.data, None
    if data[:4] == b"glTF":
        version, length = struct.unpack_from("<II", data, 4)
        if version != 2:
            raise file.fail(f"is glTF {version}; only glTF 2 is supported")
        if length > len(data):
            raise file.fail(f"is truncated: {len(data)} bytes of {length}")
        chunks: dict[bytes, bytes] = {}
        offset = 12
        while offset + 8 <= length:
            size, kind = struct.unpack_from("<I4s", data, offset)
            chunks.setdefault(kind, data[offset + 8 : offset + 8 + size])
            offset += 8 + size
        if b"JSON" not in chunks:
            raise file.fail("is not a GLB file: it has no JSON chunk")
        data, binary = chunks[b"JSON"], chunks.get(b"BIN\0")
    elif file.path.suffix.lower() == ".glb":
        raise file.fail("is not a GLB file: it does not start with 'glTF'")
    try:
        header = json.loads(data.decode("utf-8-sig"))
    except ValueError as error:
        raise file.fail(f"is not glTF: its JSON cannot be read: {error}") from None
    if not isinstance(header, dict) or "asset" not in header:
        raise file.fail("is not glTF: it has no 'asset'")
    version = str(header["asset"].get("version", "2.0"))
    if not version.startswith("2"):
        raise file.fail(f"is glTF {version}; only glTF 2 is supported")
    buffers = []
    for index, buffer in enumerate(header.get("buffers", [])):
        if "uri" in buffer:
            found = _gltf_uri(file, buffer["uri"])
            if found is None:
                raise file.fail(f"its buffer '{unquote(buffer['uri'])}' is missing")
        elif index == 0 and binary is not None:
            found = binary
        else:
            raise file.fail(f"buffer {index} has no data")
        if len(found) < buffer["byteLength"]:
            raise file.fail(f"buffer {index} is truncated: {len(found)} bytes of {buffer['byteLength']}")
        buffers.append(found)
    return header, buffers


def _gltf_uri(file: _File, uri: str) -> bytes | None:
    if uri.startswith("data:"):
        return base64.b64decode(uri.partition(",")[2])
    return file.read(file.beside(unquote(uri)))


def _gltf_nodes(file: _File, header: dict[str, Any]) -> Iterator[tuple[str | None, int, Float64]]:
    """Name, mesh and transform to the file's space of every node with a mesh in the file's scene."""
    nodes = header.get("nodes", [])
    scenes = header.get("scenes", [])
    children = {child for node in nodes for child in node.get("children", [])}
    if scenes:
        roots = scenes[header.get("scene", 0)].get("nodes", [])
    else:
        roots = [index for index in range(len(nodes)) if index not in children]
        if nodes and not roots:
            raise file.fail("its nodes form a cycle")
    if not nodes:
        yield from ((None, number, np.eye(4)) for number in range(len(header.get("meshes", []))))
    # Depth first, in the file's order, without recursion: a chain of nodes may be longer than Python's stack.
    waiting: list[tuple[int, Float64, tuple[int, ...]]] = [(root, np.eye(4), ()) for root in reversed(roots)]
    seen: set[int] = set()
    while waiting:
        index, parent, ancestors = waiting.pop()
        if index in ancestors:
            raise file.fail(f"its nodes form a cycle: node {index} is its own ancestor")
        if index in seen:
            raise file.fail(f"node {index} has two parents; glTF nodes form a tree")
        if not 0 <= index < len(nodes):
            raise file.fail(f"node {index} does not exist")
        seen.add(index)
        node = nodes[index]
        transform = parent @ _gltf_transform(node)
        if not np.isfinite(transform).all():
            raise file.fail(f"node {index} has a transform that is not finite")
        if "mesh" in node:
            yield node.get("name"), node["mesh"], transform
        below = (*ancestors, index)
        waiting += [(child, transform, below) for child in reversed(node.get("children", []))]


def _gltf_transform(node: dict[str, Any]) -> Float64:
    """(4, 4) to the parent's space: the node's matrix, or T R S."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T  # stored column by column
    result = np.eye(4)
    x, y, z, w = np.array(node.get("rotation", (0.0, 0.0, 0.0, 1.0)), dtype=np.float64)
    norm = x * x + y * y + z * z + w * w
    s = 2 / norm if norm > 0 else 0.0
    rotation = np.array(
        [
            [1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
            [s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)],
            [s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)],
        ]
    )
    result[:3, :3] = rotation * np.array(node.get("scale", (1.0, 1.0, 1.0)), dtype=np.float64)
    result[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return result


def _gltf_base(material: dict[str, Any]) -> tuple[list[float], dict[str, Any] | None]:
    """Factor (RGBA) and texture of the base colour."""
    old = material.get("extensions", {}).get("KHR_materials_pbrSpecularGlossiness")
    if old is not None and "pbrMetallicRoughness" not in material:
        return old.get("diffuseFactor", [1.0] * 4), old.get("diffuseTexture")
    pbr = material.get("pbrMetallicRoughness", {})
    return pbr.get("baseColorFactor", [1.0] * 4), pbr.get("baseColorTexture")


def _gltf_uv_set(header: dict[str, Any], primitive: dict[str, Any]) -> int:
    """Which TEXCOORD_n the base colour reads; the mesh carries that one set."""
    if "material" not in primitive:
        return 0
    texture = _gltf_base(header["materials"][primitive["material"]])[1]
    return int((texture or {}).get("texCoord", 0))


def _gltf_material(file: _File, header: dict[str, Any], buffers: list[bytes], material: dict[str, Any]) -> Material:
    factor, texture = _gltf_base(material)
    rgb = [float(x) for x in factor[:3]]
    picture = _gltf_texture(file, header, buffers, texture)
    result: Material = {"brdf": "lambert", "kd": rgb}
    if picture:
        result["kd"] = {"texture": picture[0], "factor": rgb, "wrap": picture[1]}
    mode = material.get("alphaMode", "OPAQUE")
    if mode in ("MASK", "BLEND"):
        result |= {"alpha": float(factor[3]), "alpha_mode": mode.lower()}
        if mode == "MASK":
            result["alpha_cutoff"] = float(material.get("alphaCutoff", 0.5))
    normal = material.get("normalTexture")
    picture = _gltf_texture(file, header, buffers, normal)
    if normal and picture:
        if normal.get("texCoord", 0) != (texture or {}).get("texCoord", 0):
            file.warn("a normal map uses other texture coordinates than the base colour; drawn without it")
        else:
            scale = float(normal.get("scale", 1.0))
            result["normal_map"] = {"texture": picture[0], "scale": scale, "wrap": picture[1]}
    if material.get("doubleSided", False):
        result["sides"] = "both"
    return result


def _gltf_texture(
    file: _File, header: dict[str, Any], buffers: list[bytes], info: dict[str, Any] | None
) -> tuple[str, list[str]] | None:
    """Path and wrap modes of a texture; an embedded picture is kept, unmodified, as a file of the cache entry."""
    if info is None:
        return None
    if "KHR_texture_transform" in info.get("extensions", {}):
        file.warn("KHR_texture_transform is not supported; the texture is drawn without it")
    texture = header["textures"][info["index"]]
    source = texture.get("source", texture.get("extensions", {}).get("EXT_texture_webp", {}).get("source"))
    if source is None:
        file.warn(f"texture {info['index']} has no picture that can be read; drawn without it")
        return None
    sampler = header["samplers"][texture["sampler"]] if "sampler" in texture else {}
    wrap = [_WRAP.get(sampler.get(key, 10497), "repeat") for key in ("wrapS", "wrapT")]
    image = header["images"][source]
    uri = image.get("uri", "")
    if uri and not uri.startswith("data:"):
        path = file.texture(unquote(uri))
        return (path, wrap) if path else None
    if uri:
        data = base64.b64decode(uri.partition(",")[2])
    else:
        view = header["bufferViews"][image["bufferView"]]
        start = view.get("byteOffset", 0)
        data = buffers[view["buffer"]][start : start + view["byteLength"]]
    if data.startswith(b"\x89PNG"):
        suffix = ".png"
    elif data.startswith(b"\xff\xd8"):
        suffix = ".jpg"
    else:
        suffix = ".webp" if data[8:12] == b"WEBP" else ".image"
    name = f"image{source}{suffix}"
    file.loaded.images[name] = data
    return EMBEDDED + name, wrap


_READERS: dict[str, Callable[[_File], None]] = {
    ".obj": _read_obj,
    ".ply": _read_ply,
    ".stl": _read_plain,
    ".off": _read_plain,
    ".glb": _read_gltf,
    ".gltf": _read_gltf,
}
SUFFIXES = frozenset(_READERS)
