"""Assembly: a scene with its meshes prepared, its transforms multiplied, and its materials and lights looked up.

Both renderers start from an Assembly. Its meshes are float32; everything else is still float64.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from glshade.assembly.counting import check_counts, check_texels
from glshade.assembly.default_rig import rig
from glshade.assembly.instance import Instance
from glshade.assembly.strokes import Viewport, stroked
from glshade.brdfs import BRDFS, Brdf
from glshade.calibration.calibration import Calibration
from glshade.errors import AssetWarning, SceneError
from glshade.lights import LIGHTS, Light
from glshade.limits import LARGEST_NUMBER, SMALLEST_NUMBER
from glshade.mesh.facets import faceted
from glshade.mesh.mesh import Mesh
from glshade.mesh.model import MeshPart, Model
from glshade.mesh.normals import with_normals
from glshade.mesh.order import ordered
from glshade.mesh.reading.textures import plain, unplaced
from glshade.mesh.tangents import OWN_AXES, Axes, with_tangents
from glshade.mesh.winding import turned_over
from glshade.scene.camera import View, calibration_of
from glshade.scene.object import Normals, Object, Rate
from glshade.scene.of_files import file_lights, placed
from glshade.scene.of_files import world as world_of
from glshade.scene.scene import Scene
from glshade.textures.texture import Picture

Array = NDArray[np.float64]

# A camera that chooses its own position is fitted to the scene's vertices if there are at most this many. If there are more, it
# is fitted to the meshes' bounding boxes, which is faster but shows the scene a little smaller.
FRAMED_EXACTLY = 200_000
# If the largest distance of a scene from the eye is below SMALLEST or above LARGEST [scene units], the scene is drawn in
# another unit of length. These bounds keep the squares of lengths well inside the range of float32.
SMALLEST, LARGEST = 1e-12, 1e12
# The material of an object that has none, and its name in messages.
DEFAULT_NAME = "default"
DEFAULT_MATERIAL: Brdf = BRDFS["phong"].model_validate({"kd": 0.6, "ks": 0.25, "exponent": 50.0})
# The light under which a material of `own_colour` shows exactly its base colour.
WHITE: Light = LIGHTS["ambient"].model_validate({"intensity": 1.0, "name": "unlit"})


@dataclass(frozen=True, eq=False)
class Assembly:
    """A scene with everything looked up.

    instances: the instances, in the order of the scene's objects.
    lights: the scene's lights, or the default rig where the scene lists none; with unlit materials, also `WHITE` at the end.
    view: the camera at its final position.
    objects: name of an object -> transform (4, 4) to world space [scene units].
    unit: the factor of all lengths. It differs from 1 only if the squares of lengths would leave the range of float32.
    own_light: index of the light that shows the base colours of unlit materials; None if no material is unlit.
    pieces: what the instances were made of, so that `seen_anew` need not look it up again.
    boxes: the corners (N, 8, 3) of boxes round the pieces, in world space [scene units].
    """

    instances: tuple[Instance, ...]
    lights: tuple[Light, ...]
    view: View
    objects: Mapping[str, Array] = field(default_factory=dict)
    unit: float = 1.0
    own_light: int | None = None
    pieces: tuple[_Piece, ...] = ()
    boxes: Array = field(default_factory=lambda: np.zeros((0, 8, 3)))

    def calibration(self, scene: Scene) -> Calibration:
        """Returns how the picture of a scene is seen: the pixels of its window, the camera's pose, and those of its objects.

        scene: the scene of this assembly, with the film of the picture.
        """
        view = self.view
        if self.unit != 1:
            across = 1.0 if view.perspective else self.unit
            view = replace(
                view,
                eye=view.eye / self.unit,
                near=view.near / self.unit,
                far=view.far / self.unit,
                half_width=view.half_width / across,
                half_height=view.half_height / across,
            )
        left, top, width, height = scene.film.window
        whole = calibration_of(view, scene.film.size, self.objects)
        return replace(whole, size=(width, height), cx=whole.cx - left, cy=whole.cy - top)


@dataclass(frozen=True, eq=False)
class _Piece:
    """One mesh of an object, before the view and the lights are known.

    item: the object.
    number: index of the object in the scene.
    name: name for messages: that of the object, with the part's name if the object's mesh file has several parts.
    mesh: the mesh as it was read or made.
    world: transform (4, 4) float64 of positions from object space to world space.
    material: the material to draw it with.
    made_of, source: as in `Instance`.
    """

    item: Object
    number: int
    name: str
    mesh: Mesh
    world: Array
    material: Brdf
    made_of: str
    source: object

    @cached_property
    def box(self) -> Array:
        """The corners (8, 3) of a box round the mesh, in world space."""
        upper = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)])
        return _placed(self.mesh.bounds[upper, np.arange(3)], self.world)

    def points(self) -> Array:
        """Returns the positions of the vertices in use (U, 3), in world space."""
        return _placed(self.mesh.drawn + self.mesh.origin, self.world)


def assemble(scene: Scene, shading: Rate | None = None) -> Assembly:
    """Returns the assembly of a scene.

    shading: optional, the shading rate of all objects in place of their own.
    Errors: SceneError (AssetError) with all faults of meshes, materials and missing texture coordinates.
    """
    pieces, objects = _pieces(scene, shading)
    check_texels((piece.material for piece in pieces), scene.limits)
    boxes = np.stack([piece.box for piece in pieces])
    view = _view(scene, pieces, boxes)
    own = file_lights(scene, scene.loader())
    # The lights of mesh files replace the default rig, and join the lights that the scene lists.
    lights = (*(scene.lights or ()), *own) if own or scene.lights is not None else rig(view)
    instances = tuple(_instance(scene, piece, view, lights, shading) for piece in pieces)
    problems: list[str] = []
    for piece, instance in zip(pieces, instances, strict=True):
        problems.extend(_needs_uvs(piece, instance.material))
    if problems:
        raise SceneError(problems)
    unlit = any(len(lights) in instance.lights for instance in instances)
    shown = (*lights, WHITE) if unlit else tuple(lights)
    own_light = len(lights) if unlit else None
    assembly = Assembly(instances, shown, view, objects, own_light=own_light, pieces=tuple(pieces), boxes=boxes)
    return _in_range(assembly, boxes.reshape(-1, 3))


def seen_anew(before: Assembly, scene: Scene) -> Assembly | None:
    """Returns the assembly of a scene that differs from another one in its camera alone. It shares all instances with it.

    before: the assembly of the other scene, without refined meshes.
    scene: the scene, whose objects, materials, lights, quality and film are those of the other.

    The result is None where more than the view and the default lights depends on the camera, or where a mesh file has changed.
    """
    pieces, corners, load = before.pieces, before.boxes, scene.loader()
    models = {piece.item.mesh: piece.source for piece in pieces if isinstance(piece.item.mesh, Path)}
    if any(load(path) is not model for path, model in models.items()):
        return None
    if any(piece.mesh.strokes is not None or piece.item.file_lights for piece in pieces):
        return None
    view = _view(scene, pieces, corners)
    lights = rig(view) if scene.lights is None else scene.lights
    shown = (*lights, WHITE) if before.own_light is not None else tuple(lights)
    if _alike(shown) != _alike(before.lights) or before.unit != 1 or _unit(corners.reshape(-1, 3), view) != 1:
        return None
    # A near plane that cuts a solid open shows its inside.
    for number in np.flatnonzero(_may_cut(before.view, corners) | _may_cut(view, corners)):
        instance = before.instances[number]
        if instance.back_faces != _draws_back_faces(pieces[number], instance.material, view):
            return None
    return replace(before, view=view, lights=shown)


def _alike(lights: tuple[Light, ...]) -> list[dict[str, Any]]:
    """Returns what decides which instances lights reach, and by which programs: all but their places."""
    return [light.model_dump(exclude={"position", "direction"}) for light in lights]


def _may_cut(view: View, corners: Array) -> NDArray[np.bool_]:
    """Returns for boxes, given by their corners (N, 8, 3), whether the near plane may cut them (N,)."""
    # The margin is far above the rounding of the depths, which are computed in another order for one box.
    margin = 1e-9 * float(np.abs(corners - view.eye).max())
    return np.asarray(view.depth(corners).min(axis=1) <= view.near + margin)


def _pieces(scene: Scene, shading: Rate | None) -> tuple[list[_Piece], dict[str, Array]]:
    """Returns the meshes of all objects, and the transform to world space of each object by its name.

    shading: as in `assemble`.

    Errors: SceneError with the faults of all mesh files and their materials, or where the scene exceeds a limit.
    """
    pieces: list[_Piece] = []
    objects: dict[str, Array] = {}
    problems: list[str] = []
    placements = placed(scene.objects)
    load = scene.loader()
    check_counts(scene, load, shading)
    for number, item in enumerate(scene.objects):
        world = world_of(placements, item)
        if not _is_in_range(world):
            problems.append(f"objects[{number}].transform: together with the parents' it is too large or too small")
            continue
        objects[item.name or f"objects[{number}]"] = world
        try:
            pieces.extend(_pieces_of(scene, load, number, item, world))
        except SceneError as error:
            problems.extend(f"objects[{number}].mesh: {problem}" for problem in error.problems)
    if problems:
        raise SceneError(problems)
    return pieces, objects


def _view(scene: Scene, pieces: Sequence[_Piece], boxes: Array) -> View:
    """Returns the scene's camera at its final position. boxes: the corners (N, 8, 3) of boxes round the pieces."""
    width, height = scene.film.size
    exactly = scene.camera.framing and sum(len(piece.mesh.positions) for piece in pieces) <= FRAMED_EXACTLY
    points = np.concatenate([piece.points() for piece in pieces]) if exactly else boxes.reshape(-1, 3)
    return scene.camera.view(points, width / height)


def _instance(scene: Scene, piece: _Piece, view: View, lights: tuple[Light, ...], shading: Rate | None) -> Instance:
    """Returns the instance of a piece. shading: as in `assemble`. Points and lines are always shaded per pixel."""
    of_strokes = piece.mesh.strokes is not None
    if of_strokes:
        piece = _as_triangles(scene, piece, view)
    item, mesh = piece.item, piece.mesh
    chosen = tuple(
        i
        for i, light in enumerate(lights)
        if (light.only is None or item.name in light.only) and light.intensity != 0 and any(light.colour)
    )
    ambient = any(lights[i].omnidirectional for i in chosen)
    quality = scene.quality_of(item)
    material = quality.material(piece.material).canonical(ambient)
    if material.unlit:
        # WHITE is added to the lights as the last one, and no other light reaches an unlit material.
        material, chosen = own_colour(material), (len(lights),)
    rate: Rate = "phong" if of_strokes else shading or quality.shading or item.shading
    tangents = material.needs_tangents or material.normal_map is not None or material.bump_map is not None
    levels = (quality.subdivide or 0) if rate != "phong" else 0
    # The positions of a mesh are relative to its origin.
    world_from_object = piece.world.copy()
    world_from_object[:3, 3] += piece.world[:3, :3] @ mesh.origin
    return Instance(
        name=piece.name,
        mesh=_strokes_ready(mesh, tangents)
        if of_strokes
        else _ready(mesh, rate == "flat", item.normals, item.threshold, tangents and tangent_axes(material), levels),
        world_from_object=world_from_object,
        material=material,
        rate=rate,
        back_faces=of_strokes or _draws_back_faces(piece, material, view),
        vertex_colours=item.vertex_colours and mesh.colours is not None,
        lights=chosen,
        quality=quality,
        number=piece.number,
        made_of=piece.made_of,
        source=piece.source,
    )


def _as_triangles(scene: Scene, piece: _Piece, view: View) -> _Piece:
    """Returns a piece of points and lines as triangles in world space that face the viewer.

    Without normals, the points and lines show their colours whatever the light. Where they have colours but no material, these
    colours are shown as they are.
    """
    film, mesh, material = scene.film, piece.mesh, piece.material
    # With one sample a pixel, squares and strips need no antialiasing, and edges between the pixels are more certain.
    on_grid = film.samples == 1 and film.supersample == 1
    # The triangles are stored in float32, as a multiple of the scene's unit if that has too little range.
    unit = _unit(piece.box, view)
    screen = Viewport(_view_in_unit(view, unit), film.size, film.point_size, film.point_size, on_grid)
    if mesh.normals is None:
        if material is DEFAULT_MATERIAL and mesh.colours is not None and piece.item.vertex_colours:
            material = material.model_copy(update={"kd": (1.0, 1.0, 1.0)})
        material = material.model_copy(update={"unlit": True})
    triangles = stroked(mesh, _grow(unit) @ piece.world, screen)
    return replace(piece, mesh=triangles, world=_grow(1 / unit), material=material)


def _strokes_ready(mesh: Mesh, tangents: bool) -> Mesh:
    """Returns the triangles of points and lines, with tangents if these are needed.

    The tangents are those of a mesh without uvs, because uvs do not change across a point or a line.
    """
    return replace(with_tangents(replace(mesh, uvs=None)), uvs=mesh.uvs) if tangents else mesh


def own_colour(material: Brdf) -> Brdf:
    """Returns a material that shows the base colour of this one under `WHITE`; without a base colour, its reflectance of
    ambient light.
    """
    base = material.base()
    if base is None:
        return material.model_copy(update={"occlusion": None})
    surface: dict[str, Any] = {name: getattr(material, name) for name in Brdf.model_fields if name != "brdf"}
    surface |= {"brdf": "lambert", "kd": getattr(material, base), "occlusion": None}
    return BRDFS["lambert"].model_construct(**surface)


def _in_range(assembly: Assembly, corners: Array) -> Assembly:
    """Returns an assembly that gives the same picture, and whose squared lengths fit into float32.

    All lengths are multiplied by a power of two, which rounds nothing. An assembly of ordinary size is returned as it is.
    corners: the corners of boxes round the instances (N, 3), in world space [scene units].
    """
    unit = _unit(corners, assembly.view)
    if unit == 1:
        return assembly
    return replace(
        assembly,
        instances=tuple(replace(i, world_from_object=_grow(unit) @ i.world_from_object) for i in assembly.instances),
        lights=tuple(light.scaled(unit) for light in assembly.lights),
        view=_view_in_unit(assembly.view, unit),
        unit=unit,
    )


def _unit(corners: Array, view: View) -> float:
    """Returns the factor of lengths, a power of two, with which the squares of all distances from the eye fit into float32.

    It is 1 for a scene of ordinary size. corners: the corners of boxes round the scene (N, 3), in world space [scene units].
    """
    reach = float(np.abs(corners - view.eye).max())
    return 1.0 if reach == 0 or SMALLEST <= reach <= LARGEST else 2.0 ** -round(math.log2(reach))


def _grow(factor: float) -> Array:
    """Returns the transform (4, 4) that multiplies lengths by a factor."""
    return np.diag([factor, factor, factor, 1.0])


def _view_in_unit(view: View, unit: float) -> View:
    """Returns the view with all lengths multiplied by a factor."""
    across = 1.0 if view.perspective else unit
    return replace(
        view,
        eye=view.eye * unit,
        near=view.near * unit,
        far=view.far * unit,
        half_width=view.half_width * across,
        half_height=view.half_height * across,
    )


def _pieces_of(scene: Scene, load: Callable[[Path], Model], number: int, item: Object, world: Array) -> Iterator[_Piece]:
    """Yields the meshes of one object: one for each part of its mesh file, or the only one. Errors: SceneError.

    load: the function that loads mesh files.
    number: index of the object in the scene.
    item: the object.
    world: transform (4, 4) from the object to world space.
    """
    name = item.name or f"objects[{number}]"
    own = scene.materials[item.material] if isinstance(item.material, str) else item.material
    own_name = item.material if isinstance(item.material, str) else name if own else DEFAULT_NAME
    if isinstance(item.mesh, Path):
        model = load(item.mesh)
        # Parts with equal materials share the name of the first such part.
        first: dict[str, str] = {repr(None): DEFAULT_NAME}
        for part in model.parts:
            label = f"{name}/{part.name}" if len(model.parts) > 1 else name
            made_of = own_name if own else first.setdefault(repr(part.material), label)
            material = own or _file_material(part, item.mesh)
            mesh = _wound(part.mesh, item, material)
            yield _Piece(item, number, label, mesh, world @ part.transform, material, made_of, model)
    elif item.mesh is not None or item.shape is not None:
        source = item.mesh if item.shape is None else item.shape.mesh()
        assert source is not None
        material = own or DEFAULT_MATERIAL
        yield _Piece(item, number, name, _wound(source, item, material), world, material, own_name, source)


def _wound(mesh: Mesh, item: Object, material: Brdf) -> Mesh:
    """Returns the mesh, wound as its normals say where neither the object nor its material says which sides are drawn."""
    return turned_over(mesh) if item.sides == "auto" and material.sides == "auto" else mesh


# The materials that mesh files give to their parts, for as long as the parts exist.
_file_materials: WeakKeyDictionary[MeshPart, Brdf] = WeakKeyDictionary()


def _file_material(part: MeshPart, path: Path) -> Brdf:
    """Returns the material that a mesh file gives to a part; the same object for the same part.

    A part without texture coordinates is drawn without the textures of its material, with a warning.
    path: the mesh file, which messages name.
    Errors: SceneError.
    """
    if part.material is None:
        return DEFAULT_MATERIAL
    given = plain(part.material) if part.mesh.uvs is None else part.material
    if given is not part.material:
        warnings.warn(f"{path}: {unplaced(part.name)}", AssetWarning, stacklevel=2)
    try:
        if part not in _file_materials:
            _file_materials[part] = BRDFS[given["brdf"]].model_validate(given)
        return _file_materials[part]
    except ValidationError as error:
        faults = error.errors(include_url=False)
        raise SceneError(
            [f"{path}: material of {part.name}: {'.'.join(map(str, e['loc']))}: {e['msg']}" for e in faults]
        ) from None


def _is_in_range(world: Array) -> bool:
    """Returns whether the numbers of a transform (4, 4) are in the range whose squares and cubes fit into float64;
    NaN is not.
    """
    sizes = np.abs(world[:3, :3]).max(axis=0)
    return bool(np.abs(world).max() <= LARGEST_NUMBER and sizes.min() >= SMALLEST_NUMBER)


def _placed(points: Array, world: Array) -> Array:
    """Returns the points (N, 3) transformed by an affine matrix (4, 4)."""
    placed: Array = points @ world[:3, :3].T + world[:3, 3]
    return placed


def _draws_back_faces(piece: _Piece, material: Brdf, view: View) -> bool:
    """Returns whether an object's back faces are drawn.

    By default they are culled where the mesh is solid and seen from outside, since none of them is visible then.
    """
    sides: Literal["auto", "front", "both"] = piece.item.sides if piece.item.sides != "auto" else material.sides
    if sides != "auto":
        return sides == "both"
    if material.alpha_mode != "opaque" or not piece.mesh.is_solid:
        return True
    # The near plane may cut a solid open, which shows its inside. The vertices are only tested if the plane cuts the box.
    if view.depth(piece.box).min() > view.near:
        return False
    return bool(view.depth(piece.points()).min() <= view.near)


def _needs_uvs(piece: _Piece, material: Brdf) -> Iterator[str]:
    """Yields a fault for each texture of the material if the mesh has no texture coordinates."""
    if piece.mesh.uvs is None:
        for key in (*material.parameters(), "emission", "occlusion", "normal_map", "bump_map", "tangent_direction"):
            if hasattr(getattr(material, key), "texture"):
                yield f"{piece.name}: its material's {key} is a texture, but its mesh has no texture coordinates"


# mesh -> the meshes that `_ready` made from it, by the arguments of `_make`. They are freed together with the mesh, so that an
# object with a new mesh in every frame does not fill the memory.
_made: WeakKeyDictionary[Mesh, dict[tuple[object, ...], Mesh | None]] = WeakKeyDictionary()


def _ready(mesh: Mesh, *wishes: Any) -> Mesh:
    """Returns the mesh with the attributes that its instance needs; the same object for the same mesh and wishes.

    wishes: the further arguments of `_make`.
    """
    variants = _made.setdefault(mesh, {})
    if wishes not in variants:
        ready = _make(mesh, *wishes)
        # Store None for "unchanged": a value that refers to its own weak key would never be freed.
        variants[wishes] = None if ready is mesh else ready
    return variants[wishes] or mesh


def tangent_axes(material: Brdf) -> Axes:
    """Returns the axes that the tangents follow: those of the map of normals or heights, or else of the map of directions."""
    maps = (material.normal_map, material.bump_map, material.tangent_direction)
    placements = [picture.placement for picture in maps if isinstance(picture, Picture)]
    if not placements:
        return OWN_AXES
    across, up = placements[0]
    return across[:2], up[:2]


def _make(mesh: Mesh, flat: bool, normals: Normals, threshold: float, tangents: Axes | Literal[False], levels: int) -> Mesh:
    """Returns a mesh that is ready for one shading rate.

    flat: whether each triangle gets vertices of its own, with the normal of the face.
    normals, threshold: as in `with_normals`, [degrees].
    tangents: the axes of the mesh's tangents; False for a mesh without them.
    levels: how many times each triangle is cut into four.
    """
    # The search for edges is several times as fast where neighbours in space are neighbours in memory.
    ready = mesh if flat and not tangents else with_normals(ordered(mesh), normals, threshold)
    if tangents:
        ready = with_tangents(ready, tangents)
    if levels:
        from glshade.mesh.subdivision import subdivided

        ready = subdivided(ready, levels)
    return ordered(faceted(ready) if flat else ready)
