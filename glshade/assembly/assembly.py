"""Assembly: a Scene with everything looked up: meshes loaded and made ready, transforms multiplied, materials and lights found.

Both renderers start here. Nothing is rounded yet but the meshes, which are float32 from the start.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, Literal
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from glshade.brdfs import BRDFS, Brdf
from glshade.errors import SceneError
from glshade.lights import LIGHTS, Light
from glshade.mesh import file as mesh_file
from glshade.mesh.mesh import Mesh, faceted, ordered, with_normals, with_tangents
from glshade.scene.camera import View
from glshade.scene.quality import Quality
from glshade.scene.scene import Normals, Object, Rate, Scene

Array = NDArray[np.float64]


# Up to here a camera that frames the scene looks at every vertex; beyond, at boxes, which takes no time and leaves more air.
FRAMED_EXACTLY = 200_000


# depth: with the instance's number beside it.
Shows = Literal["light", "depth", "uv", "normal"]


@dataclass(frozen=True, eq=False)
class Instance:
    """One mesh in its place.

    name: the object's, for messages. mesh: ready for its rate (faceted for flat), with tangents where they are asked for.
    world_from_object (4, 4) float64, for positions relative to the mesh's own origin. back_faces: whether they are drawn.
    lights: which of the assembly's reach it. quality: the object's and the scene's together; rate and mesh have it in them.
    number: of the scene's objects, which one. made_of: its material's name, or that of the first object or part which has it.
    shows: light, or what else of its surface a picture has in that place.
    """

    name: str
    mesh: Mesh
    world_from_object: Array
    material: Brdf
    rate: Rate
    back_faces: bool
    vertex_colours: bool
    lights: tuple[int, ...]
    quality: Quality
    number: int
    made_of: str
    shows: Shows = "light"

    @cached_property
    def mirrored(self) -> bool:
        """Whether the transform turns counter-clockwise into clockwise."""
        return bool(np.linalg.det(self.world_from_object[:3, :3]) < 0)


@dataclass(frozen=True, eq=False)
class Assembly:
    """Instances in scene order, the lights (a default rig where the scene has none), and the view.

    unit: how long the scene's unit of length is here; 1 but where float32 could not hold the squares of lengths.
    """

    instances: tuple[Instance, ...]
    lights: tuple[Light, ...]
    view: View
    unit: float = 1.0


def assemble(scene: Scene, shading: Rate | None = None) -> Assembly:
    """Looks everything up. `shading` overrules every object's.

    Errors: SceneError (AssetError) with every fault of every mesh, material and texture coordinate.
    """
    problems: list[str] = []
    pieces: list[tuple[Object, str, Mesh, Array, Brdf, str]] = []
    by_name = {item.name: item for item in scene.objects}
    numbers = {id(item): index for index, item in enumerate(scene.objects)}
    for index, item in enumerate(scene.objects):
        try:
            pieces.extend(_pieces(scene, by_name, item, item.name or f"objects[{index}]"))
        except SceneError as error:
            problems.extend(f"objects[{index}].mesh: {problem}" for problem in error.problems)
    if problems:
        raise SceneError(problems)
    boxes = [_corners(mesh.bounds, world) for _, _, mesh, world, *_ in pieces]
    width, height = scene.film.size
    points = boxes
    if scene.camera.framing and sum(len(mesh.positions) for _, _, mesh, *_ in pieces) <= FRAMED_EXACTLY:
        points = [_placed(mesh.positions + mesh.origin, world) for _, _, mesh, world, *_ in pieces]
    view = scene.camera.view(np.concatenate(points), width / height)
    lights = scene.lights if scene.lights is not None else rig(view)
    instances = []
    for (item, name, mesh, world, material, made_of), box in zip(pieces, boxes, strict=True):
        chosen = tuple(
            i
            for i, light in enumerate(lights)
            if (light.only is None or item.name in light.only) and light.intensity != 0 and any(light.colour)
        )
        ambient = any(lights[i].omnidirectional for i in chosen)
        quality = item.quality.over(scene.quality) if item.quality else scene.quality
        material = quality.material(material).canonical(ambient)
        rate = shading or quality.shading or item.shading
        problems.extend(f"{name}: {problem}" for problem in _needs_uvs(mesh, material))
        back_faces = _draws_back_faces(item, mesh, material, world, box, view)
        tangents = material.needs_tangents or material.normal_map is not None or material.bump_map is not None
        levels = (quality.subdivide or 0) if rate != "phong" else 0
        ready = _ready(mesh, rate == "flat", item.normals, item.threshold, tangents, levels)
        local = world.copy()
        local[:3, 3] += world[:3, :3] @ mesh.origin
        colours = item.vertex_colours and mesh.colours is not None
        number = numbers[id(item)]
        instances.append(Instance(name, ready, local, material, rate, back_faces, colours, chosen, quality, number, made_of))
    if problems:
        raise SceneError(problems)
    return _in_range(Assembly(tuple(instances), tuple(lights), view), np.concatenate(boxes))


# Within these the squares of lengths stay well inside float32; scenes beyond are drawn in another unit of length.
SMALLEST, LARGEST = 1e-12, 1e12


def _in_range(assembly: Assembly, corners: Array) -> Assembly:
    """The assembly, or the same picture at a size whose squares float32 can hold: all lengths times a power of two."""
    view = assembly.view
    reach = float(np.abs(corners - view.eye).max())
    if reach == 0 or SMALLEST <= reach <= LARGEST:
        return assembly
    unit = 2.0 ** -round(math.log2(reach))
    grow = np.diag([unit, unit, unit, 1.0])
    across = 1.0 if view.perspective else unit
    return Assembly(
        tuple(replace(i, world_from_object=grow @ i.world_from_object) for i in assembly.instances),
        tuple(light.scaled(unit) for light in assembly.lights),
        replace(
            view,
            eye=view.eye * unit,
            near=view.near * unit,
            far=view.far * unit,
            half_width=view.half_width * across,
            half_height=view.half_height * across,
        ),
        unit,
    )


def rig(view: View) -> tuple[Light, ...]:
    """The lights of a scene that says nothing of light: a key over the viewer's left shoulder, a fill, a little ambient."""
    right, up, backward = view.axes

    def toward(x: float, y: float, z: float) -> tuple[float, ...]:
        return tuple(float(c) for c in -(x * right + y * up + z * backward))

    directional, ambient = LIGHTS["directional"], LIGHTS["ambient"]
    return (
        directional.model_validate({"name": "key", "direction": toward(-0.7, 0.9, 0.8), "intensity": 0.95}),
        directional.model_validate({"name": "fill", "direction": toward(1.0, 0.1, 0.6), "intensity": 0.2}),
        ambient.model_validate({"name": "ambient", "intensity": 0.08}),
    )


def _pieces(
    scene: Scene, by_name: dict[str | None, Object], item: Object, name: str
) -> Iterator[tuple[Object, str, Mesh, Array, Brdf, str]]:
    """(object, name, mesh, world_from_object, material, its name): one for each part of its mesh file."""
    world = _world(by_name, item)
    own = scene.materials[item.material] if isinstance(item.material, str) else item.material
    own_name = item.material if isinstance(item.material, str) else name if own else DEFAULT_NAME
    if item.shape is not None:
        yield item, name, item.shape.mesh(), world, own or DEFAULT_MATERIAL, own_name
    elif isinstance(item.mesh, Mesh):
        yield item, name, item.mesh, world, own or DEFAULT_MATERIAL, own_name
    elif item.mesh is not None:
        model = mesh_file.load(item.mesh)
        # Parts of one material may share it.
        first: dict[str, str] = {repr(None): DEFAULT_NAME}
        for part in model.parts:
            label = f"{name}/{part.name}" if len(model.parts) > 1 else name
            made_of = own_name if own else first.setdefault(repr(part.material), label)
            yield item, label, part.mesh, world @ part.transform, own or _file_material(part, item.mesh), made_of


@lru_cache(maxsize=4096)
def _file_material(part: mesh_file.Part, path: Path) -> Brdf:
    if part.material is None:
        return DEFAULT_MATERIAL
    try:
        return BRDFS[part.material["brdf"]].model_validate(part.material)
    except ValidationError as error:
        faults = error.errors(include_url=False)
        raise SceneError(
            [f"{path}: material of {part.name}: {'.'.join(map(str, e['loc']))}: {e['msg']}" for e in faults]
        ) from None


DEFAULT_NAME = "default"
DEFAULT_MATERIAL: Brdf = BRDFS["phong"].model_validate({"kd": 0.6, "ks": 0.25, "exponent": 50.0})


def _world(by_name: dict[str | None, Object], item: Object) -> Array:
    world = item.transform.array()
    while item.parent is not None:
        item = by_name[item.parent]
        world = item.transform.array() @ world
    return world


def _corners(bounds: Array, world: Array) -> Array:
    """(8, 3): the corners of the box, in world space."""
    which = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)])
    return _placed(bounds[which, np.arange(3)], world)


def _placed(points: Array, world: Array) -> Array:
    placed: Array = points @ world[:3, :3].T + world[:3, 3]
    return placed


def _draws_back_faces(item: Object, mesh: Mesh, material: Brdf, world: Array, box: Array, view: View) -> bool:
    """Culling loses nothing where the mesh is solid and seen from outside; else both sides are drawn."""
    sides: Literal["auto", "front", "both"] = item.sides if item.sides != "auto" else material.sides
    if sides != "auto":
        return sides == "both"
    if material.alpha_mode != "opaque" or not mesh.is_solid:
        return True
    # The near plane may cut a solid open. Where it cuts the box, the mesh itself is asked.
    if view.depth(box).min() > view.near:
        return False
    return bool(view.depth(_placed(mesh.positions + mesh.origin, world)).min() <= view.near)


def _needs_uvs(mesh: Mesh, material: Brdf) -> Iterator[str]:
    if mesh.uvs is None:
        for name in (*material.parameters(), "normal_map", "bump_map", "tangent_direction"):
            if hasattr(getattr(material, name), "texture"):
                yield f"its material's {name} is a texture, but its mesh has no texture coordinates"


# What was made of a mesh goes with it: a mesh that is new in every frame leaves nothing behind.
_made: WeakKeyDictionary[Mesh, dict[tuple[object, ...], Mesh | None]] = WeakKeyDictionary()


def _ready(mesh: Mesh, *wishes: Any) -> Mesh:
    """The mesh with the attributes that its instance needs; the same object for the same wishes (`_make`)."""
    made = _made.setdefault(mesh, {})
    if wishes not in made:
        ready = _make(mesh, *wishes)
        # None stands for the mesh itself, which would else keep itself alive.
        made[wishes] = None if ready is mesh else ready
    return made[wishes] or mesh


def _make(mesh: Mesh, flat: bool, normals: Normals, threshold: float, tangents: bool, levels: int) -> Mesh:
    ready = mesh if flat and not tangents else with_normals(mesh, normals, threshold)
    if tangents:
        ready = with_tangents(ready)
    if levels:
        from glshade.mesh.subdivision import subdivided

        ready = subdivided(ready, levels)
    return ordered(faceted(ready) if flat else ready)
