"""Information: the facts about a mesh file that `glshade info` prints."""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from glshade.arrays import Float64
from glshade.errors import AssetError
from glshade.image.file import parts as picture_parts
from glshade.limits import DEFAULT, Limits
from glshade.mesh.file import AssetWarning, load
from glshade.mesh.model import MeshPart, Model
from glshade.mesh.reading.gltf_container import MAGIC
from glshade.mesh.reading.textures import plain, unplaced

# The unit of one number in a file, for formats that fix it. The readers of .dae and .3mf convert to these units.
UNITS = {".gltf": "metre", ".glb": "metre", ".dae": "metre", ".3mf": "millimetre"}
# Slicers take the numbers of STL files for millimetres. In another format without a unit, a thing whose longest side is shorter
# than this is more likely in metres, and else in millimetres: few things that people model are longer than 10 m, and few that
# are measured in millimetres are shorter than 10 mm.
LIKELY_METRES = 10.0
# The most triangles whose edges are compared; the comparison of more would take gigabytes and many seconds.
MOST_COMPARED = 4_000_000


def mesh_information(path: Path, limits: Limits = DEFAULT) -> dict[str, Any]:
    """Returns the facts about a mesh file, as a table that can be written as JSON. Errors: AssetError."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", AssetWarning)
        model = load(path, limits)
    suffix = path.suffix.lower()
    parts = [_part(part) for part in model.parts]
    low, high = bounds(model)
    return {
        "file": str(path),
        "kind": "mesh",
        "format": suffix[1:].upper(),
        "bytes": path.stat().st_size,
        "parts": parts,
        **{name: sum(part[name] for part in parts) for name in ("triangles", "lines", "points", "vertices")},
        "bounds": [low.tolist(), high.tolist()],
        "unit": unit(suffix, float((high - low).max())),
        **surface(model),
        "materials": list(_materials(model)),
        "extensions": extensions(path) if suffix in (".gltf", ".glb") else {},
        "lights": [light.get("type", "") for light in getattr(model, "lights", ())],
        "cameras": list(getattr(model, "cameras", ())),
        "warnings": [
            *(str(warning.message).removeprefix(f"{path}: ") for warning in caught),
            *(unplaced(part.name) for part in model.parts if _is_unplaced(part)),
        ],
    }


def _is_unplaced(part: MeshPart) -> bool:
    """Returns whether a part has textures, but no texture coordinates."""
    return part.mesh.uvs is None and part.material is not None and plain(part.material) is not part.material


def _part(part: MeshPart) -> dict[str, Any]:
    """Returns the facts about one part of a file."""
    mesh = part.mesh
    strokes = getattr(mesh, "strokes", None)
    points = 0 if strokes is None else int((strokes[:, 0] == strokes[:, 1]).sum())
    return {
        "name": part.name,
        "triangles": len(mesh.triangles),
        "lines": 0 if strokes is None else len(strokes) - points,
        "points": points,
        "vertices": len(mesh.positions),
        "normals": mesh.normals is not None,
        "uvs": mesh.uvs is not None,
        "colours": mesh.colours is not None,
        "tangents": mesh.tangents is not None,
        "material": (part.material or {}).get("brdf"),
    }


def _placed(part: MeshPart) -> Float64:
    """Returns the vertices of a part in file space, (V, 3) float64."""
    points = part.mesh.positions.astype(np.float64) + part.mesh.origin
    return points @ part.transform[:3, :3].T + part.transform[:3, 3]


def bounds(model: Model) -> tuple[Float64, Float64]:
    """Returns the smallest and the largest coordinates of all vertices (3,) in file space."""
    corners = [f(points, axis=0) for part in model.parts if len(points := _placed(part)) for f in (np.min, np.max)]
    return np.min(corners, axis=0), np.max(corners, axis=0)


def unit(suffix: str, longest: float) -> dict[str, Any]:
    """Returns the unit of a file: its name, and whether it is a guess from the length of the longest side."""
    if suffix in UNITS:
        return {"name": UNITS[suffix], "guess": False}
    metres = suffix != ".stl" and longest < LIKELY_METRES
    return {"name": "metre" if metres else "millimetre", "guess": True}


def surface(model: Model) -> dict[str, Any]:
    """Returns whether all triangles together are closed, and how they are wound. A value is None where it is not known.

    Vertices at the same position count as one. The surface is closed if no edge belongs to one triangle alone. It is "mixed" if
    more triangles run through some edge in one direction than in the other, not counting the last triangle of an odd number. A
    closed surface without such edges is "outward" if it encloses a positive volume, and else "inward".
    """
    unknown = {"closed": None, "open_edges": None, "winding": None}
    if not 0 < sum(len(part.mesh.triangles) for part in model.parts) <= MOST_COMPARED:
        return unknown
    corners = np.concatenate([_oriented(part) for part in model.parts if len(part.mesh.triangles)])
    corners -= corners.mean(axis=(0, 1))
    # Transforms of parts round differently, so positions are compared to seven digits of the size.
    grid = max(float(np.abs(corners).max()), 1e-30) * 1e-7
    _, label = np.unique(np.round(corners.reshape(-1, 3) / grid).astype(np.int64), axis=0, return_inverse=True)
    a, b, c = label.reshape(-1, 3).T
    kept = (a != b) & (b != c) & (c != a)
    start, end = np.concatenate([a, b, c])[np.tile(kept, 3)], np.concatenate([b, c, a])[np.tile(kept, 3)]
    lower, higher = np.minimum(start, end), np.maximum(start, end)
    _, edge, count = np.unique(lower * (int(label.max()) + 1) + higher, return_inverse=True, return_counts=True)
    # The number of triangles that run through the edge in one direction, less the number of those that run in the other.
    surplus = np.abs(np.bincount(edge.ravel(), np.where(start < end, 1.0, -1.0), minlength=len(count)))
    open_edges = int((count == 1).sum())
    facts = {"closed": open_edges == 0, "open_edges": open_edges}
    if (surplus > 1).any():
        return {**facts, "winding": "mixed"}
    if surplus.any():
        return {**facts, "winding": "consistent"}
    x, y, z = corners.transpose(1, 0, 2)
    outward = float(np.einsum("ij,ij->", x, np.cross(y, z))) > 0
    return {**facts, "winding": "outward" if outward else "inward"}


def _oriented(part: MeshPart) -> Float64:
    """Returns the corners of a part's triangles in file space, (T, 3, 3), with a mirroring transform's winding turned back."""
    corners = _placed(part)[part.mesh.triangles]
    return corners[:, ::-1] if np.linalg.det(part.transform[:3, :3]) < 0 else corners


def _materials(model: Model) -> Iterator[dict[str, Any]]:
    """Yields the facts about each material that differs from those before: its model, textures and parts."""
    seen: dict[str, list[str]] = {}
    for part in model.parts:
        if part.material is not None:
            seen.setdefault(json.dumps(part.material, sort_keys=True, default=str), []).append(part.name)
    for text, names in seen.items():
        material = json.loads(text)
        yield {"brdf": material.get("brdf"), "parts": len(names), "textures": list(_textures(material))}


def _textures(material: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Yields the parameter, file and size [pixels] of each texture of a material."""
    for key, value in material.items():
        if isinstance(value, Mapping) and "texture" in value:
            try:
                size: list[int] | None = list(picture_parts(value["texture"])[0].size)
            except AssetError:
                size = None
            yield {"key": key, "file": Path(value["texture"]).name, "size": size}


def extensions(path: Path) -> dict[str, bool]:
    """Returns the extensions of a glTF file that `load` has read before: name -> whether the file requires it."""
    data = path.read_bytes()
    if data[:4] == MAGIC:
        data = data[20 : 20 + int.from_bytes(data[12:16], "little")]
    header = json.loads(data.decode("utf-8-sig"))
    required = set(header.get("extensionsRequired", ()))
    return {name: name in required for name in sorted({*header.get("extensionsUsed", ()), *required})}
