"""Assembly: a scene with its meshes prepared, its transforms multiplied, and its materials and lights looked up.

Both renderers start from an Assembly. Its meshes are float32; everything else is still float64.
"""

from __future__ import annotations

import math
import operator
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import groupby
from pathlib import Path
from typing import Any, Literal, TypeVar
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from glshade.assembly.counting import check_counts, check_texels
from glshade.assembly.default_rig import rig
from glshade.assembly.illumination import Illumination, Observer, is_spectral
from glshade.assembly.instance import Instance
from glshade.assembly.strokes import Squares, Viewport, stroked
from glshade.brdfs import BRDFS, Brdf
from glshade.calibration.calibration import Calibration
from glshade.errors import AssetWarning, SceneError
from glshade.lights import LIGHTS, Light
from glshade.limits import LARGEST_NUMBER, SMALLEST_NUMBER
from glshade.mesh.copies import Copies
from glshade.mesh.facets import faceted
from glshade.mesh.mesh import Mesh
from glshade.mesh.model import MeshPart, Model
from glshade.mesh.normals import with_normals
from glshade.mesh.order import ordered
from glshade.mesh.reading.textures import plain, unplaced
from glshade.mesh.tangents import OWN_AXES, Axes, with_tangents
from glshade.mesh.winding import turned_over
from glshade.scene.camera import View, calibration_of, extent
from glshade.scene.object import Normals, Object, Rate
from glshade.scene.of_files import file_lights, placed
from glshade.scene.of_files import world as world_of
from glshade.scene.scene import Scene
from glshade.textures.texture import Picture

Array = NDArray[np.float64]

# A camera that chooses its own position is fitted to the scene's vertices if there are at most this many. If there are more, it
# is fitted to the meshes' bounding boxes, which is faster but shows the scene a little smaller.
FRAMED_EXACTLY = 200_000
# A mesh with more triangles is put in local order before its edges are searched: its arrays do not fit a processor's cache.
SORTED_FIRST = 100_000
# If the largest distance of a scene from the eye is below SMALLEST or above LARGEST [scene units], the scene is drawn in
# another unit of length. These bounds keep the squares of lengths well inside the range of float32.
SMALLEST, LARGEST = 1e-12, 1e12
# The material of an object that has none, and its name in messages.
DEFAULT_NAME = "default"
DEFAULT_MATERIAL: Brdf = BRDFS["phong"].model_validate({"kd": 0.6, "ks": 0.25, "exponent": 50.0})
# Whether a corner of a box (8) is on the upper side along each axis (3).
UPPER = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)])
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
    cut: whether the near plane may cut the boxes round the pieces (N,).
    illumination: the spectra of the lights; None in a scene without spectra.
    """

    instances: tuple[Instance, ...]
    lights: tuple[Light, ...]
    view: View
    objects: Mapping[str, Array] = field(default_factory=dict)
    unit: float = 1.0
    own_light: int | None = None
    pieces: _Pieces = field(default_factory=lambda: _Pieces())
    cut: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))
    illumination: Illumination | None = None

    def first_parts(self) -> Assembly:
        """Returns the assembly with the first part of each instance in its place; the same object where no instance has shares.

        The light of the `further_parts` is added to it.
        """
        if not any(instance.shares for instance in self.instances):
            return self
        return replace(self, instances=tuple(instance.parts[0] for instance in self.instances))

    def further_parts(self) -> Assembly:
        """Returns the assembly with all parts but the first of each instance."""
        return replace(self, instances=tuple(part for instance in self.instances for part in instance.parts[1:]))

    def of_bands(self, first: int) -> Assembly:
        """Returns the assembly with three of the bands of the layer `spectrum` in place of red, green and blue.

        first: the index of the first band.
        Errors: SceneError for an object without a spectrum.
        """
        assert self.illumination is not None
        bands = self.illumination.of_bands(first, self.lights)
        own = () if self.own_light is None else (WHITE,)
        return replace(self, instances=tuple(map(bands.lit, self.instances)), lights=(*bands.lights, *own))

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
    def world_from_mesh(self) -> Array:
        """The transform (4, 4) of positions relative to the mesh's origin."""
        world = self.world.copy()
        world[:3, 3] += self.world[:3, :3] @ self.mesh.origin
        return world

    @cached_property
    def box(self) -> Array:
        """The corners (8, 3) of a box round the mesh, in world space."""
        return _placed(self.mesh.bounds[UPPER, np.arange(3)], self.world)

    def points(self) -> Array:
        """Returns the positions of the vertices in use (U, 3), in world space."""
        return _placed(self.mesh.drawn + self.mesh.origin, self.world)


class _Pieces(tuple[_Piece, ...]):
    """The pieces of a scene, which its assemblies for all views share."""

    @cached_property
    def models(self) -> dict[Path, object]:
        """The contents of all mesh files by path."""
        return {piece.item.mesh: piece.source for piece in self if isinstance(piece.item.mesh, Path)}

    @cached_property
    def follow_the_view(self) -> bool:
        """Whether there are points and lines, or lights of mesh files, which are made anew for another view."""
        return any(_is_thin(piece) or piece.item.file_lights for piece in self)

    @cached_property
    def materials(self) -> tuple[Brdf, ...]:
        """The materials, each once."""
        return tuple({id(piece.material): piece.material for piece in self}.values())

    @cached_property
    def boxes(self) -> Array:
        """The corners (N, 8, 3) of boxes round the pieces, in world space [scene units]."""
        return np.stack([piece.box for piece in self])

    @cached_property
    def extent(self) -> Array:
        """The least and the largest coordinates (2, 3) of all boxes [scene units]."""
        return extent(self.boxes.reshape(-1, 3))


def assemble(scene: Scene, shading: Rate | None = None) -> Assembly:
    """Returns the assembly of a scene.

    shading: optional, the shading rate of all objects in place of their own.
    Errors: SceneError (AssetError) with all faults of meshes, materials and missing texture coordinates.
    """
    pieces, objects = _pieces(scene, shading)
    check_texels(iter(pieces.materials), scene.limits)
    view = _view(scene, pieces)
    may_cut = _may_cut(view, pieces)
    cut = may_cut.tolist()
    own = file_lights(scene, scene.loader())
    # The lights of mesh files replace the default rig, and join the lights that the scene lists.
    lights = (*(scene.lights or ()), *own) if own or scene.lights is not None else rig(view)
    illumination = _illumination(scene, lights, pieces)
    lights = illumination.lights if illumination else lights
    instances: list[Instance] = []
    for _, of_object in groupby(zip(pieces, cut, strict=True), key=lambda pair: pair[0].number):
        copy: Callable[..., Instance] | None = None
        for piece, may_be_cut in of_object:
            if copy:
                back_faces = _draws_back_faces(piece, instances[-1].material, view, may_be_cut)
                instances.append(copy(world_from_object=piece.world_from_mesh, back_faces=back_faces))
                continue
            instances.append(_instance(scene, piece, view, lights, shading, may_be_cut))
            if isinstance(piece.item.mesh, Copies) and not _is_thin(piece):
                copy = _copier(instances[-1])
    if illumination:
        instances = [illumination.lit(instance) for instance in instances]
    problems = list(_missing_uvs(pieces, instances))
    if problems:
        raise SceneError(problems)
    unlit = any(len(lights) in instance.lights for instance in instances)
    shown = (*lights, WHITE) if unlit else tuple(lights)
    own_light = len(lights) if unlit else None
    assembly = Assembly(
        tuple(instances), shown, view, objects, own_light=own_light, pieces=pieces, cut=may_cut, illumination=illumination
    )
    return _in_range(assembly, pieces.extent)


def seen_anew(before: Assembly, scene: Scene) -> Assembly | None:
    """Returns the assembly of a scene that differs from another one in its camera alone. It shares all instances with it.

    before: the assembly of the other scene, without refined meshes.
    scene: the scene, whose objects, materials, lights, quality and film are those of the other.

    The result is None where more than the view and the default lights depends on the camera, or where a mesh file has changed.
    """
    pieces, load = before.pieces, scene.loader()
    if pieces.follow_the_view or any(load(path) is not model for path, model in pieces.models.items()):
        return None
    view = _view(scene, pieces)
    lights = rig(view) if scene.lights is None else scene.lights
    illumination = _illumination(scene, lights, pieces)
    lights = illumination.lights if illumination else lights
    shown = (*lights, WHITE) if before.own_light is not None else tuple(lights)
    same = all(map(operator.is_, shown, before.lights)) or _alike(shown) == _alike(before.lights)
    if len(shown) != len(before.lights) or not same or before.unit != 1 or _unit(pieces.extent, view) != 1:
        return None
    # A near plane that cuts a solid open shows its inside.
    cut = _may_cut(view, pieces)
    for number in np.flatnonzero(before.cut | cut):
        instance = before.instances[number]
        if instance.back_faces != _draws_back_faces(pieces[number], instance.material, view, True):
            return None
    return replace(before, view=view, lights=shown, cut=cut)


def _illumination(scene: Scene, lights: tuple[Light, ...], pieces: _Pieces) -> Illumination | None:
    """Returns the spectra of a scene's lights; None where nothing in the scene has a spectrum. Errors: AssetError."""
    if not is_spectral(scene.film, lights, pieces.materials):
        return None
    return Illumination(Observer.of_film(scene.film), lights, scene.film.bands)


def _alike(lights: tuple[Light, ...]) -> list[dict[str, Any]]:
    """Returns what decides which instances lights reach, and by which programs: all but their places."""
    return [light.model_dump(exclude={"position", "direction"}) for light in lights]


def _may_cut(view: View, pieces: _Pieces) -> NDArray[np.bool_]:
    """Returns for the boxes round N pieces whether the near plane may cut them (N,)."""
    # The margin is far above the rounding of the depths, which are computed in another order for one box.
    margin = 1e-9 * float(np.abs(pieces.extent - view.eye).max())
    near = view.depth(pieces.boxes) <= view.near + margin
    # NumPy finds the largest of many numbers much faster than that of every eight.
    return np.asarray(near.any(axis=1) if near.any() else np.zeros(len(pieces), dtype=np.bool_))


def _pieces(scene: Scene, shading: Rate | None) -> tuple[_Pieces, dict[str, Array]]:
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
    return _Pieces(pieces), objects


def _view(scene: Scene, pieces: _Pieces) -> View:
    """Returns the scene's camera at its final position."""
    width, height = scene.film.size
    exactly = scene.camera.framing and sum(len(piece.mesh.positions) for piece in pieces) <= FRAMED_EXACTLY
    points = np.concatenate([piece.points() for piece in pieces]) if exactly else pieces.boxes.reshape(-1, 3)
    return scene.camera.view(points, width / height)


def _is_thin(piece: _Piece) -> bool:
    """Returns whether a piece consists of points or lines, which are drawn as triangles that face the viewer."""
    return piece.mesh.strokes is not None


T = TypeVar("T", _Piece, Instance)


def _copier(value: T) -> Callable[..., T]:
    """Returns a function that makes changed copies of a piece or an instance, as `replace` does, in a tenth of its time.

    Its arguments are the new values of fields and of cached properties, by name.
    """
    kind = type(value)
    kept = [(name, getattr(value, name)) for name in kind.__dataclass_fields__]

    def copy(**changes: Any) -> T:
        result = object.__new__(kind)
        # An object gets a dictionary of its own once Python is asked for it, and then Python's garbage collector has twice as
        # much to visit.
        for name, given in kept:
            object.__setattr__(result, name, given)
        for name, given in changes.items():
            object.__setattr__(result, name, given)
        return result

    return copy


def _instance(
    scene: Scene, piece: _Piece, view: View, lights: tuple[Light, ...], shading: Rate | None, may_be_cut: bool
) -> Instance:
    """Returns the instance of a piece. Points are always shaded once each, and lines per pixel.

    shading: as in `assemble`.
    may_be_cut: as in `_draws_back_faces`.
    """
    of_strokes, coloured = _is_thin(piece), piece.mesh.colours is not None
    if of_strokes:
        piece = _as_triangles(scene, piece, view)
    item, mesh = piece.item, piece.mesh
    chosen = tuple(
        i
        for i, light in enumerate(lights)
        if (light.only is None or item.name in light.only) and light.intensity != 0 and any(light.rgb)
    )
    ambient = any(lights[i].omnidirectional for i in chosen)
    quality = scene.quality_of(item)
    material = quality.material(piece.material).canonical(ambient)
    if material.unlit:
        # WHITE is added to the lights as the last one, and no other light reaches an unlit material.
        material, chosen = own_colour(material), (len(lights),)
    rate: Rate = shading or quality.shading or item.shading
    if of_strokes:
        rate = "flat" if isinstance(mesh, Squares) else "phong"
    tangents = material.needs_tangents or material.normal_map is not None or material.bump_map is not None
    levels = (quality.subdivide or 0) if rate != "phong" else 0
    return Instance(
        name=piece.name,
        mesh=_strokes_ready(mesh, tangents)
        if of_strokes
        else _ready(mesh, rate == "flat", item.normals, item.threshold, tangents and tangent_axes(material), levels),
        world_from_object=piece.world_from_mesh,
        material=material,
        rate=rate,
        # The viewer sees the front of every square.
        back_faces=not isinstance(mesh, Squares) and (of_strokes or _draws_back_faces(piece, material, view, may_be_cut)),
        vertex_colours=item.vertex_colours and coloured,
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
        source = item.own_mesh if item.shape is None else item.shape.mesh()
        assert source is not None
        material = own or DEFAULT_MATERIAL
        piece = _Piece(item, number, name, _wound(source, item, material), world, material, own_name, source)
        if isinstance(item.mesh, Copies):
            yield from _copies(piece, item.mesh.poses)
        else:
            yield piece


def _copies(piece: _Piece, poses: Array) -> Iterator[_Piece]:
    """Yields a piece at each of several poses (N, 4, 4). They are placed together, in a tenth of the time of one by one.

    Errors: SceneError for a pose that is too large or too small.
    """
    worlds = piece.world @ poses
    linear, place = worlds[:, :3, :3], worlds[:, :3, 3]
    sizes = np.abs(linear).max(axis=1)
    fits = (np.abs(worlds).max(axis=(1, 2)) <= LARGEST_NUMBER) & (sizes.min(axis=1) >= SMALLEST_NUMBER)
    if not fits.all():
        raise SceneError(f"poses[{int(fits.argmin())}]: together with the object's transform it is too large or too small")
    from_mesh = worlds.copy()
    from_mesh[:, :3, 3] += linear @ piece.mesh.origin
    boxes = piece.mesh.bounds[UPPER, np.arange(3)] @ linear.transpose(0, 2, 1) + place[:, None]
    copy = _copier(piece)
    for world, world_from_mesh, box in zip(worlds, from_mesh, boxes, strict=True):
        yield copy(world=world, world_from_mesh=world_from_mesh, box=box)


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


def _draws_back_faces(piece: _Piece, material: Brdf, view: View, may_be_cut: bool) -> bool:
    """Returns whether an object's back faces are drawn.

    By default they are culled where the mesh is solid and seen from outside, since none of them is visible then.
    may_be_cut: whether the near plane may cut the piece's box, as `_may_cut` says.
    """
    sides: Literal["auto", "front", "both"] = piece.item.sides if piece.item.sides != "auto" else material.sides
    if sides != "auto":
        return sides == "both"
    if material.alpha_mode != "opaque" or not piece.mesh.is_solid:
        return True
    # The near plane may cut a solid open, which shows its inside. The vertices are only tested if the plane cuts the box.
    if not may_be_cut or view.depth(piece.box).min() > view.near:
        return False
    return bool(view.depth(piece.points()).min() <= view.near)


def _missing_uvs(pieces: Sequence[_Piece], instances: Sequence[Instance]) -> Iterator[str]:
    """Yields a fault for each texture of a material on a mesh without texture coordinates."""
    textured: dict[int, list[str]] = {}
    for piece, instance in zip(pieces, instances, strict=True):
        material = instance.material
        if piece.mesh.uvs is None:
            if id(material) not in textured:
                keys = (*material.parameters(), "emission", "occlusion", "normal_map", "bump_map", "tangent_direction")
                textured[id(material)] = [key for key in keys if hasattr(getattr(material, key), "texture")]
            for key in textured[id(material)]:
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
    # The search for edges of a large mesh is several times as fast where neighbours in space are neighbours in memory. A small
    # one keeps its order here, so that the next mesh with the same triangles has the same edges.
    if len(mesh.triangles) > SORTED_FIRST:
        mesh = ordered(mesh)
    ready = mesh if flat and not tangents else with_normals(mesh, normals, threshold)
    if tangents:
        ready = with_tangents(ready, tangents)
    if levels:
        from glshade.mesh.subdivision import subdivided

        ready = subdivided(ready, levels)
    return ordered(faceted(ready) if flat else ready)
