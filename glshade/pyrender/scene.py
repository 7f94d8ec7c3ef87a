"""Scene: converts pyrender's scenes into glshade's: their objects, materials, lights and main camera."""

from __future__ import annotations

import math
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from glshade.assembly.strokes import Viewport
from glshade.brdfs import Brdf
from glshade.errors import SceneError
from glshade.image.srgb import srgb_to_linear
from glshade.lights import LIGHTS, Light
from glshade.mesh.copies import Copies, are_flat
from glshade.mesh.file import AssetWarning
from glshade.mesh.mesh import Mesh
from glshade.pyrender.cameras import affine_rows, camera
from glshade.pyrender.materials import WHITE, Colour, material, silhouette
from glshade.pyrender.meshes import arrays, is_drawn_with_points, is_drawn_with_strokes, lost_triangles, mesh, points, strokes
from glshade.scene.camera import Perspective, is_singular
from glshade.scene.film import Film
from glshade.scene.object import Object, Transform
from glshade.scene.scene import Scene

Array = NDArray[np.float64]

# The distance below which a light grows no brighter [m]. It is tiny, because pyrender has no such limit.
R_MIN = 1e-9
# The lights for flat and silhouette materials. Under these lights the materials show exactly their colours.
AS_THEY_ARE: tuple[Light, ...] = (LIGHTS["ambient"](type="ambient"),)


def from_pyrender(scene: Any, size: tuple[int, int] = (640, 480)) -> Scene:
    """Returns the Scene of a pyrender.Scene, with 4 samples a pixel as in pyrender's pictures.

    It has the meshes with their instances, materials and textures, the lights, the main camera and the background. If there is
    no camera, a default one is chosen that shows the whole scene. Lines become strips, a pixel wide as seen by the main camera.
    AssetWarnings list everything that has no counterpart in glshade and is left out.

    scene: a pyrender.Scene.
    size: width, height of the picture [pixels].
    Errors: SceneError, also where nothing is left to draw.
    """
    main = main_camera(scene, size)
    if getattr(main, "flipped", False):
        raise SceneError("the camera's projection turns the picture upside down: only OffscreenRenderer can draw that")
    viewport = None if main is None else lambda: screen(main, size)
    converted = Conversion().convert(scene, scene.mesh_nodes, Look(), viewport)
    if note := getattr(main, "note", ""):
        converted.warn(note)
    if converted.wires:
        converted.warn("wireframes are drawn solid")
    for note in converted.notes:
        warnings.warn(f"pyrender: {note}", AssetWarning, stacklevel=2)
    if not converted.objects:
        raise SceneError("the scene has nothing to draw")
    given = np.asarray(scene.bg_color, dtype=np.float64)
    # pyrender's background colour is display-encoded.
    background = tuple(float(c) for c in srgb_to_linear(given[:3]))
    if given[3] < 1:
        background = (*background, float(given[3]))
    objects, materials = _named(converted)
    return Scene(
        objects=objects,
        materials=materials,
        lights=lights(scene),
        camera=main or Perspective(),
        film=Film(size=size, samples=4, background=background),
    )


def main_camera(scene: Any, size: tuple[int, int]) -> Any:
    """Returns the main camera of a pyrender.Scene as a camera of glshade; None if the scene has no main camera.

    size: width, height of the picture [pixels].
    Errors: SceneError.
    """
    node = scene.main_camera_node
    return None if node is None else camera(node.camera, scene.get_pose(node), size)


def screen(main: Any, size: tuple[int, int]) -> Viewport:
    """Returns the picture in which lines have a width.

    main: pyrender's main camera, converted to a camera of glshade.
    size: width, height of the picture [pixels].
    """
    # `view` fits the far plane to the points that it is given. Squares and strips do not depend on the far plane, so any point
    # will do.
    return Viewport(main.view(np.zeros((1, 3)), size[0] / size[1]), size)


@dataclass(frozen=True)
class Look:
    """The way in which materials are converted.

    kind: "lit" for the materials themselves, "flat" for their base colours, "silhouette" for one colour for each node.
    both: True to draw back faces even where a material does not ask for it.
    colours: node -> colour of its silhouette, from 0 to 1; the default is white.
    named: whether objects are named after the places of their nodes, as `lights` needs for a limited number of lights.
    together: whether the instances of a primitive of triangles are one object.
    """

    kind: Literal["lit", "flat", "silhouette"] = "lit"
    both: bool = False
    colours: Mapping[Any, Colour] = field(default_factory=dict)
    named: bool = False
    together: bool = False


@dataclass(eq=False)
class Converted:
    """Converted nodes.

    objects: the N objects, one for every instance of every primitive, or for all instances of one.
    names: N pairs, the object's name and its material's name. A name is empty if pyrender's object has no name.
    wires: the numbers of the objects that pyrender draws as wireframes.
    notes: the warnings about everything that was left out, each once.
    """

    objects: list[Object]
    names: list[tuple[str, str]]
    wires: set[int]
    notes: list[str]

    def warn(self, *notes: str) -> None:
        """Adds warnings, except those that are in the list already."""
        self.notes.extend(note for note in notes if note not in self.notes)


class Conversion:
    """Converts nodes into objects. For nodes that have not changed, it returns the same objects as in the last conversion."""

    def __init__(self) -> None:
        # (kind, both) of a Look -> the cache of meshes and objects of the last conversion. A key of this cache contains the ids
        # of the sources. An entry is (sources, result): as long as the sources are held, Python does not reuse their ids.
        self._last: dict[tuple[str, bool], dict[tuple[Any, ...], tuple[Any, Any]]] = {}

    def convert(self, scene: Any, nodes: Iterable[Any], look: Look, make_viewport: Callable[[], Viewport] | None) -> Converted:
        """Converts the visible meshes of nodes, in pyrender's drawing order.

        The order matters: pyrender draws from far to near, and of several surfaces at the same depth the first one drawn is
        visible.

        scene: the pyrender.Scene that the nodes belong to.
        nodes: the nodes to convert.
        look: the way in which materials are converted.
        make_viewport: returns the picture in which lines have a width; None leaves them out with a warning.
        Errors: SceneError.
        """
        placed = in_order(scene, nodes)
        result = Converted([], [], set(), [])
        last = self._last.get((look.kind, look.both), {})
        current: dict[tuple[Any, ...], tuple[Any, Any]] = {}

        def cached(sources: Any, key: tuple[Any, ...], make: Callable[[], Any]) -> Any:
            current[key] = last.get(key) or current.get(key) or (sources, make())
            return current[key][1]

        coloured = look.kind != "silhouette"
        viewport: Viewport | None = None
        for node, pose in placed:
            for primitive in node.mesh.primitives:
                if coloured:
                    brdf, notes = material(primitive, look.kind == "flat", look.both)
                    result.warn(*notes)
                else:
                    brdf = silhouette(primitive, look.colours.get(node, WHITE), look.both)
                sources = arrays(primitive)
                if not is_drawn_with_strokes(primitive):
                    lost = cached(sources, tuple(map(id, sources)), partial(lost_triangles, primitive))
                    if lost:
                        result.warn(
                            f"{node.mesh.name or 'a mesh'}: {lost} triangles with a corner that is not finite are left out"
                        )
                together = look.together and primitive.poses is not None and not is_drawn_with_strokes(primitive)
                for world in [pose] if together else instances(primitive, pose):
                    shape: Mesh | Copies | None
                    if together:
                        shape = self._copies(mesh(primitive), primitive.poses, cached)
                    elif not is_drawn_with_strokes(primitive):
                        shape = mesh(primitive)
                    elif is_drawn_with_points(primitive):
                        shape, lost = cached(sources, ("points", *map(id, sources)), partial(points, primitive))
                        if lost:
                            result.warn(f"{node.mesh.name or 'a mesh'}: {lost} points that are not finite are left out")
                    elif make_viewport is not None:
                        viewport = viewport or make_viewport()
                        key = (*map(id, sources), world.tobytes(), viewport.key)
                        shape = cached(sources, key, partial(strokes, primitive, world, viewport))
                        # The mesh of lines is in world space already.
                        world = np.eye(4)
                    else:
                        shape = None
                        result.warn("lines are left out: they are as wide as pixels, and the scene has no camera")
                    if shape is None:
                        continue
                    name = place_name(pose) if look.named else None
                    key = (id(shape), id(brdf), world.tobytes(), name)
                    item = cached((shape, brdf), key, partial(placed_object, shape, brdf, world, coloured, name))
                    if item is not None:
                        if primitive.material.wireframe and coloured:
                            result.wires.add(len(result.objects))
                        result.objects.append(item)
                        result.names.append((node.name or node.mesh.name or "", primitive.material.name or ""))
        self._last[look.kind, look.both] = current
        return result

    @staticmethod
    def _copies(shape: Mesh | None, poses: Any, cached: Callable[..., Any]) -> Copies | None:
        """Returns a mesh at several poses (N, 4, 4); None without a mesh, or if every pose flattens it."""
        if shape is None:
            return None
        placed = np.asarray(poses, dtype=np.float64)
        # The bytes tell of poses that are changed in place.
        copies: Copies | None = cached((shape,), ("copies", id(shape), placed.tobytes()), partial(copied, shape, placed))
        return copies


def in_order(scene: Any, nodes: Iterable[Any]) -> list[tuple[Any, Array]]:
    """Returns (node, pose (4, 4)) of each visible node in pyrender's drawing order. scene: the pyrender.Scene of the nodes."""
    eye = np.zeros(3) if scene.main_camera_node is None else scene.get_pose(scene.main_camera_node)[:3, 3]
    placed = [(node, scene.get_pose(node)) for node in nodes if node.mesh.is_visible]
    placed.sort(key=lambda pair: (-float(np.linalg.norm(pair[1][:3, 3] - eye)), pair[0].name or "", pair[1].tobytes()))
    return placed


def instances(primitive: Any, pose: Array) -> Iterator[Array]:
    """Yields the pose (4, 4) of each instance of a primitive. pose: (4, 4), the pose of the primitive's node."""
    if primitive.poses is None:
        yield pose
    else:
        yield from (pose @ own for own in primitive.poses.astype(np.float64))


def copied(shape: Mesh, poses: Array) -> Copies | None:
    """Returns a mesh at those of the poses (N, 4, 4) that do not flatten it; None if all of them do."""
    solid = poses[~are_flat(poses[:, :3, :3])]
    # The last row is replaced, in case it has rounding errors.
    solid[:, 3] = 0, 0, 0, 1
    return Copies.build(shape, solid) if len(solid) else None


def placed_object(shape: Mesh | Copies, brdf: Brdf, pose: Array, coloured: bool, name: str | None = None) -> Object | None:
    """Returns an object; None if its pose (4, 4) flattens it, because a flat object covers no pixel."""
    if is_singular(pose[:3, :3]):
        return None
    # model_construct skips validation: all parts are valid, and validating them again takes longer than the whole conversion.
    rows: Any = tuple(map(tuple, affine_rows(pose)))
    transform = Transform.model_construct(matrix=rows)
    return Object.model_construct(mesh=shape, transform=transform, material=brdf, vertex_colours=coloured, name=name)


def _named(converted: Converted) -> tuple[tuple[Object, ...], dict[str, Brdf]]:
    """Returns (objects, materials by name). A name that several objects or materials have is followed by a number."""
    objects: list[Object] = []
    materials: dict[str, Brdf] = {}
    taken: set[str] = set()
    last: Counter[str] = Counter()
    for item, (own, of_material) in zip(converted.objects, converted.names, strict=True):
        names: dict[str, str] = {}
        if own:
            name = own
            while name in taken:
                last[own] += 1
                name = f"{own}.{last[own]}"
            taken.add(name)
            names["name"] = name
        if of_material and isinstance(item.material, Brdf):
            name, number = of_material, 0
            # Primitives of the same material have equal `item.material`, unless they differ in vertex colours or texture
            # coordinates.
            while materials.setdefault(name, item.material) != item.material:
                number += 1
                name = f"{of_material}.{number}"
            names["material"] = name
        objects.append(item.model_copy(update=names))
    return tuple(objects), materials


# --- lights ----------------------------------------------------------------------------------------------------------


def place_name(pose: Array) -> str:
    """Returns the name of all objects of the nodes at one place. pose: (4, 4), the node's."""
    return pose[:3, 3].tobytes().hex()


def lights(scene: Any, most: int | None = None) -> tuple[Light, ...]:
    """Returns the lights of a pyrender.Scene.

    An intensity of E lux or candela becomes E / pi, the radiance of a white Lambertian surface that faces the light.

    scene: a pyrender.Scene.
    most: the number of lights of a kind that light an object, those nearest to its node; None for all. The objects must have
        been converted with a Look that names them.
    """
    poses = [] if most is None else [np.asarray(pose) for _, pose in in_order(scene, scene.mesh_nodes)]
    return tuple(LIGHTS[table["type"]].model_validate(table) for table in _lights(scene, most, poses))


# The number of lights of a kind that pyrender's shader uses.
PYRENDER_LIGHTS = 4


def crowded(scene: Any) -> bool:
    """Returns whether a pyrender.Scene has more lights of a kind than pyrender uses."""
    kinds = (scene.directional_light_nodes, scene.point_light_nodes, scene.spot_light_nodes)
    return any(len(nodes) > PYRENDER_LIGHTS for nodes in kinds)


def _lights(scene: Any, most: int | None, poses: list[Array]) -> Iterator[dict[str, Any]]:
    """Yields each light as a table of a scene file. most: as for `lights`. poses: (4, 4) of each mesh node."""
    if np.any(scene.ambient_light):
        yield {"type": "ambient", "colour": _three(scene.ambient_light)}

    def ordered(nodes: Iterable[Any]) -> Iterator[tuple[Any, Array, dict[str, Any]]]:
        # pyrender keeps lights in sets, whose order varies from run to run. The lights are sorted, because the sum of their
        # light is rounded differently in each order.
        placed = [(node.light, scene.get_pose(node)) for node in nodes]
        placed.sort(key=lambda pair: pair[1].tobytes())
        chosen: list[set[str]] = [set() for _ in placed]
        if most is not None and len(placed) > most:
            places = np.array([pose[:3, 3] for _, pose in placed])
            for pose in poses:
                for i in np.argsort(np.linalg.norm(places - pose[:3, 3], axis=1), kind="stable")[:most]:
                    chosen[i].add(place_name(pose))
        limited = most is not None and len(placed) > most
        for (light, pose), names in zip(placed, chosen, strict=True):
            yield light, pose, {"only": tuple(sorted(names))} if limited else {}

    def common(light: Any) -> dict[str, Any]:
        return {"colour": _three(light.color), "intensity": light.intensity / math.pi, "name": light.name}

    for light, pose, only in ordered(scene.directional_light_nodes):
        yield {"type": "directional", **common(light), **only, "direction": _three(-pose[:3, 2])}
    for light, pose, only in ordered(scene.point_light_nodes):
        yield {"type": "point", **common(light), **only, "position": _three(pose[:3, 3]), "r_min": R_MIN}
    for light, pose, only in ordered(scene.spot_light_nodes):
        cone = {"inner": math.degrees(light.innerConeAngle), "outer": math.degrees(light.outerConeAngle)}
        place = {"direction": _three(-pose[:3, 2]), "position": _three(pose[:3, 3]), "r_min": R_MIN}
        yield {"type": "gltf_spot", **common(light), **only, **place, **cone}


def _three(values: Any) -> tuple[float, float, float]:
    """Returns the first three numbers of an array."""
    x, y, z = (float(value) for value in values[:3])
    return x, y, z
