"""Scenes of pyrender, as scenes of glshade."""

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

from glshade.brdfs import Brdf
from glshade.errors import SceneError
from glshade.image.srgb import srgb_to_linear
from glshade.lights import LIGHTS, Light
from glshade.mesh.file import AssetWarning
from glshade.mesh.mesh import Mesh
from glshade.pyrender.cameras import affine_rows, camera
from glshade.pyrender.materials import WHITE, Colour, material, silhouette
from glshade.pyrender.meshes import Screen, arrays, is_drawn_with_strokes, mesh, strokes
from glshade.scene.camera import Perspective, is_singular
from glshade.scene.scene import Film, Object, Scene, Transform

Array = NDArray[np.float64]

# pyrender has no distance below which a light grows no brighter; less than this, nothing is [m].
R_MIN = 1e-9
# The lights under which surfaces show their base colours.
AS_THEY_ARE: tuple[Light, ...] = (LIGHTS["ambient"](type="ambient"),)


def from_pyrender(scene: Any, size: tuple[int, int] = (640, 480)) -> Scene:
    """The Scene of a pyrender.Scene, for a picture of `size` (width, height), 4 samples a pixel as there.

    Meshes with their instances, materials, textures, lights, the main camera (without one, the scene is framed) and the
    background. Points and lines become strips a pixel wide as that camera sees them. What has no counterpart is left out with
    an AssetWarning. Errors: SceneError, where nothing is left to draw too.
    """
    seen_from = main_camera(scene, size)
    seen_on = None if seen_from is None else lambda: screen(seen_from, size)
    found = Conversion().convert(scene, scene.mesh_nodes, Look(), seen_on)
    for note in found.notes + ["wireframes are drawn solid"] * bool(found.wires):
        warnings.warn(f"pyrender: {note}", AssetWarning, stacklevel=2)
    if not found.objects:
        raise SceneError("the scene has nothing to draw")
    background = np.asarray(scene.bg_color, dtype=np.float64)
    # What pyrender clears with is shown as it is.
    shown = [float(c) for c in srgb_to_linear(background[:3])] + [float(background[3])] * bool(background[3] < 1)
    objects, materials = _named(found)
    return Scene(
        objects=objects,
        materials=materials,
        lights=lights(scene),
        camera=seen_from or Perspective(),
        film=Film(size=size, samples=4, background=tuple(shown)),
    )


def main_camera(scene: Any, size: tuple[int, int]) -> Any:
    """The main camera, None where the scene has none. Errors: SceneError."""
    node = scene.main_camera_node
    return None if node is None else camera(node.camera, scene.get_pose(node), size)


def screen(seen_from: Any, size: tuple[int, int], point_size: float = 1.0) -> Screen:
    """What points and lines need to know of a camera's picture."""
    # Where the far plane is matters to neither.
    return Screen(seen_from.view(np.zeros((1, 3)), size[0] / size[1]), size, point_size)


@dataclass(frozen=True)
class Look:
    """What is made of the materials. lit: themselves. flat: base colours as they are. silhouette: the colour of their node.

    both: back faces are drawn too. colours: node -> colour, white where it says nothing.
    """

    kind: Literal["lit", "flat", "silhouette"] = "lit"
    both: bool = False
    colours: Mapping[Any, Colour] = field(default_factory=dict)


@dataclass(eq=False)
class Converted:
    """objects: one for every primitive in every instance. names: (its own, its material's) of each, empty where there is none.
    wires: the numbers of those drawn as wireframes. notes: what was left out."""

    objects: list[Object]
    names: list[tuple[str, str]]
    wires: set[int]
    notes: list[str]

    def say(self, *notes: str) -> None:
        """Each once."""
        self.notes.extend(note for note in notes if note not in self.notes)


class Conversion:
    """Makes objects of nodes; what has not changed since the last time is not made again, and is the same object."""

    def __init__(self) -> None:
        # What was made, by what it was made of; that is kept with it, so that nothing else comes to have its number.
        self._last: dict[tuple[str, bool], dict[tuple[Any, ...], tuple[Any, Any]]] = {}

    def convert(self, scene: Any, nodes: Iterable[Any], look: Look, seen_on: Callable[[], Screen] | None) -> Converted:
        """The nodes' visible meshes in pyrender's order, from far to near: of surfaces at one place the first is seen.

        seen_on: for points and lines, which are left out without. Errors: SceneError.
        """
        eye = np.zeros(3) if scene.main_camera_node is None else scene.get_pose(scene.main_camera_node)[:3, 3]
        placed = [(node, scene.get_pose(node)) for node in nodes if node.mesh.is_visible]
        placed.sort(key=lambda pair: (-float(np.linalg.norm(pair[1][:3, 3] - eye)), pair[0].name or "", pair[1].tobytes()))
        result = Converted([], [], set(), [])
        last = self._last.get((look.kind, look.both), {})
        now: dict[tuple[Any, ...], tuple[Any, Any]] = {}

        def kept(made_of: Any, key: tuple[Any, ...], make: Callable[[], Any]) -> Any:
            now[key] = last.get(key) or now.get(key) or (made_of, make())
            return now[key][1]

        coloured = look.kind != "silhouette"
        on: Screen | None = None
        for node, pose in placed:
            for primitive in node.mesh.primitives:
                if coloured:
                    made, notes = material(primitive, look.kind == "flat", look.both)
                    result.say(*notes)
                else:
                    made = silhouette(primitive, look.colours.get(node, WHITE), look.both)
                given = arrays(primitive)
                for place in _instances(primitive, pose):
                    if not is_drawn_with_strokes(primitive):
                        shape = mesh(primitive)
                    elif seen_on is not None:
                        on = on or seen_on()
                        key = (*map(id, given), place.tobytes(), on.key)
                        shape = kept(given, key, partial(strokes, primitive, place, on))
                        place = np.eye(4)
                    else:
                        shape = None
                        result.say("points and lines are left out: they are as wide as pixels, and the scene has no camera")
                    if shape is None:
                        continue
                    key = (id(shape), id(made), place.tobytes())
                    found = kept((shape, made), key, partial(_object, shape, made, place, coloured))
                    if found is not None:
                        if primitive.material.wireframe and coloured:
                            result.wires.add(len(result.objects))
                        result.objects.append(found)
                        result.names.append((node.name or node.mesh.name or "", primitive.material.name or ""))
        self._last[look.kind, look.both] = now
        return result


def _instances(primitive: Any, pose: Array) -> Iterator[Array]:
    if primitive.poses is None:
        yield pose
    else:
        yield from (pose @ own for own in primitive.poses.astype(np.float64))


def _object(shape: Mesh, made: Brdf, place: Array, coloured: bool) -> Object | None:
    """None for what is flattened: it covers no pixel."""
    if is_singular(place[:3, :3]):
        return None
    # All of it is known to be right: validating it again takes longer than all else here.
    rows: Any = tuple(map(tuple, affine_rows(place)))
    transform = Transform.model_construct(matrix=rows)
    return Object.model_construct(mesh=shape, transform=transform, material=made, vertex_colours=coloured)


def _named(found: Converted) -> tuple[tuple[Object, ...], dict[str, Brdf]]:
    """The objects under their names, and their materials."""
    objects: list[Object] = []
    materials: dict[str, Brdf] = {}
    taken: set[str] = set()
    last: Counter[str] = Counter()
    for item, (own, of_material) in zip(found.objects, found.names, strict=True):
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
            # What is made of one material is the same, but for primitives with colours or without texture coordinates.
            while materials.setdefault(name, item.material) != item.material:
                number += 1
                name = f"{of_material}.{number}"
            names["material"] = name
        objects.append(item.model_copy(update=names))
    return tuple(objects), materials


# --- lights ----------------------------------------------------------------------------------------------------------


def lights(scene: Any) -> tuple[Light, ...]:
    """All lights. E lux, or E candela, are an intensity of E / pi: that of a white Lambertian that faces the light."""
    return tuple(LIGHTS[table["type"]].model_validate(table) for table in _lights(scene))


def _lights(scene: Any) -> Iterator[dict[str, Any]]:
    if np.any(scene.ambient_light):
        yield {"type": "ambient", "colour": _three(scene.ambient_light)}

    def ordered(nodes: Iterable[Any]) -> list[tuple[Any, Array]]:
        # Sums are rounded in their order, and a set has none.
        placed = [(node.light, scene.get_pose(node)) for node in nodes]
        return sorted(placed, key=lambda pair: pair[1].tobytes())

    def common(light: Any) -> dict[str, Any]:
        return {"colour": _three(light.color), "intensity": light.intensity / math.pi, "name": light.name}

    for light, pose in ordered(scene.directional_light_nodes):
        yield {"type": "directional", **common(light), "direction": _three(-pose[:3, 2])}
    for light, pose in ordered(scene.point_light_nodes):
        yield {"type": "point", **common(light), "position": _three(pose[:3, 3]), "r_min": R_MIN}
    for light, pose in ordered(scene.spot_light_nodes):
        cone = {"inner": math.degrees(light.innerConeAngle), "outer": math.degrees(light.outerConeAngle)}
        where = {"direction": _three(-pose[:3, 2]), "position": _three(pose[:3, 3]), "r_min": R_MIN}
        yield {"type": "gltf_spot", **common(light), **where, **cone}


def _three(values: Any) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values[:3])
    return x, y, z
