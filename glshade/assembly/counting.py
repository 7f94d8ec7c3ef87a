"""Counting: compares the work that a scene asks for with its limits, before the work begins."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from glshade.brdfs import Brdf
from glshade.errors import SceneError
from glshade.image import file as picture_file
from glshade.limits import MOST_INSTANCES, TEXELS_PER_BYTE, UNLIMITED, Limits
from glshade.mesh.copies import Copies
from glshade.mesh.mesh import Mesh
from glshade.mesh.model import Model
from glshade.scene.object import Object, Rate
from glshade.scene.scene import Scene
from glshade.textures.texels import Texels, texels_of
from glshade.textures.texture import Picture


def check_counts(scene: Scene, load: Callable[[Path], Model], shading: Rate | None) -> None:
    """Checks the numbers of shaded pixels, parts and triangles of a scene whose mesh files can be read.

    load: the function that loads mesh files.
    shading: optional, the shading rate of all objects in place of their own.
    Errors: SceneError with the number, the limit and the option that raises it.
    """
    if scene.limits == UNLIMITED:
        return
    excess = scene.film.excess(scene.limits)
    if excess:
        raise SceneError(f"film.size: {excess}")
    parts, made, stored = 0, 0, {}
    for item in scene.objects:
        times = 4 ** _levels(scene, item, shading)
        if isinstance(item.mesh, Path):
            model = load(item.mesh)
            stored[item.mesh] = sum({id(part.mesh): _triangle_count(part.mesh) for part in model.parts}.values())
            parts += len(model.parts)
            made += times * sum(_triangle_count(part.mesh) for part in model.parts)
        elif item.mesh is not None or item.shape is not None:
            copies = len(item.mesh.poses) if isinstance(item.mesh, Copies) else 1
            parts += copies
            mesh = item.own_mesh
            made += copies * times * (item.shape.triangle_count if item.shape else _triangle_count(mesh) if mesh else 0)
    made -= sum(stored.values())
    if made > scene.limits.max_triangles:
        raise SceneError(
            f"objects: shapes, subdivision and copies make {made:,} triangles; {scene.limits.max_triangles:,} are allowed: "
            "see --max-triangles"
        )
    if parts > MOST_INSTANCES:
        raise SceneError(f"objects: {parts:,} parts are drawn; {MOST_INSTANCES:,} are allowed")


def _triangle_count(mesh: Mesh) -> int:
    """Returns the number of triangles that a mesh is drawn with. A point or a line takes two."""
    return len(mesh.triangles) if mesh.strokes is None else 2 * len(mesh.strokes)


def check_texels(materials: Iterator[Brdf], limits: Limits) -> None:
    """Checks the number of pixels of all textures from files. Only the headers of the files are read.

    Errors: SceneError with the number, the limit and the option that raises it; AssetError for a picture that cannot be read.
    """
    if limits == UNLIMITED:
        return
    found: set[Texels] = set()
    for material in {id(material): material for material in materials}.values():
        found |= {
            texels_of(material, name) for name in type(material).model_fields if isinstance(getattr(material, name), Picture)
        }
    paths = [texels.source for texels in found if isinstance(texels.source, Path)]
    total = sum(map(picture_file.pixel_count, paths))
    stored = sum(path.stat().st_size for path in set(paths))
    if total > max(limits.max_texels, TEXELS_PER_BYTE * stored):
        raise SceneError(f"materials: the textures have {total:,} pixels; {limits.max_texels:,} are allowed: see --max-texels")


def _levels(scene: Scene, item: Object, shading: Rate | None) -> int:
    """Returns the number of times that each triangle of an object is cut into four."""
    quality = scene.quality_of(item)
    return (quality.subdivide or 0) if (shading or quality.shading or item.shading) != "phong" else 0
