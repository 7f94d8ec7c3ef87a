"""Scenes: changes of scenes that several laws make."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.assembly.assembly import DEFAULT_MATERIAL, assemble
from glshade.brdfs import BRDFS, Brdf
from glshade.lights import Light
from glshade.mesh.copies import Copies
from glshade.mesh.mesh import Mesh
from glshade.scene.camera import Camera, Intrinsics, Orthographic, Perspective, View, calibration_of, intrinsics
from glshade.scene.object import Object, Transform
from glshade.scene.scene import Scene
from glshade.verification.laws._law import NotApplicableError

Array = NDArray[np.float64]

# The keys of lights that `moved_world` can change, or that a motion of the world leaves alone.
_KNOWN_KEYS = {*Light.model_fields, "position", "direction", "falloff", "r_min", "inner", "outer"}


def rows(matrix: Array) -> tuple[tuple[float, ...], ...]:
    """Returns a matrix as a scene file writes it, as tuples of numbers."""
    return tuple(map(tuple, matrix.tolist()))


def written_out(scene: Scene) -> Scene:
    """Returns the scene with its default lights listed, and with the camera at the place where it puts itself.

    A change of the written-out scene then moves neither the lights nor the camera by itself.
    """
    assembly = assemble(scene)
    # An assembly of extreme size is in another unit of length. Its lights and its view would not fit the scene.
    if assembly.unit != 1:
        raise NotApplicableError("the scene is so small or large that it is drawn in another unit of length")
    camera = camera_at(assembly.view, isinstance(scene.camera, Intrinsics))
    objects = tuple(item.model_copy(update={"file_lights": False}) if item.file_lights else item for item in scene.objects)
    return scene.model_copy(update={"camera": camera, "lights": lights_of(scene), "objects": objects})


def lights_of(scene: Scene) -> tuple[Light, ...]:
    """Returns the scene's lights with those of its mesh files, or the default lights where there are none."""
    if scene.lights is not None and not any(item.file_lights for item in scene.objects):
        return scene.lights
    assembly = assemble(scene)
    return assembly.lights[: assembly.own_light]


def camera_at(view: View, calibrated: bool = False) -> Camera:
    """Returns the camera that has this view in a picture of the same aspect.

    calibrated: whether the view need not be centred, nor its pixels be square.
    """
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = view.axes.T, view.eye
    place = {"matrix": rows(matrix), "near": view.near, "far": view.far}
    if calibrated:
        # The numbers are those of a picture of one pixel.
        seen = calibration_of(view, (1, 1), {})
        return Intrinsics.model_validate(intrinsics(seen))
    if view.perspective:
        return Perspective.model_validate({**place, "fov": 2 * math.degrees(math.atan(view.half_height))})
    return Orthographic.model_validate({**place, "height": 2 * view.half_height})


def moved_world(scene: Scene, move: Array, scale: float = 1.0) -> Scene:
    """Returns the scene with its objects, lights and camera moved.

    move: (4, 4), the motion: a rotation, a mirroring or a translation, whose linear part is multiplied by `scale`.
    scale: the factor of all lengths.
    Errors: NotApplicableError for a light whose keys are not all known.
    """
    scene = written_out(scene)
    return scene.model_copy(
        update={
            "objects": tuple(
                item if item.parent is not None else placed(item, move @ item.transform.array()) for item in scene.objects
            ),
            "lights": tuple(_moved_light(light, move, scale) for light in scene.lights or ()),
            "camera": _moved_camera(scene.camera, move, scale),
        }
    )


def placed(item: Object, matrix: Array) -> Object:
    """Returns the object with a matrix (4, 4) as its transform."""
    return item.model_copy(update={"transform": Transform.model_validate({"matrix": rows(matrix)})})


def _moved_light(light: Light, move: Array, scale: float) -> Light:
    unknown = set(type(light).model_fields) - _KNOWN_KEYS
    if unknown or (light.omnidirectional and not light.ignores_normal):
        raise NotApplicableError(f"lights of type {light.type} may not move with the world")
    changes: dict[str, Any] = {}
    if hasattr(light, "position"):
        changes["position"] = tuple((move[:3, :3] @ light.position + move[:3, 3]).tolist())
    if hasattr(light, "direction"):
        changes["direction"] = tuple((move[:3, :3] @ light.direction / scale).tolist())
    return light.scaled(scale).model_copy(update=changes)


def _moved_camera(camera: Any, move: Array, scale: float) -> Any:
    matrix = np.array(camera.matrix)
    matrix[:3, :3] = move[:3, :3] @ matrix[:3, :3] / scale
    matrix[:3, 3] = move[:3, :3] @ matrix[:3, 3] + move[:3, 3]
    changes: dict[str, Any] = {"near": camera.near * scale, "far": camera.far * scale}
    if np.linalg.det(move[:3, :3]) < 0:
        # A camera cannot be mirrored; its picture is. So its x axis stays on the same side, and its picture's middle does not.
        matrix[:3, 0] *= -1
        if isinstance(camera, Intrinsics):
            changes["cx"] = camera.width - camera.cx
    changes["matrix"] = rows(matrix)
    if isinstance(camera, Intrinsics) and camera.projection == "orthographic":
        changes |= {"fx": camera.fx / scale, "fy": camera.fy / scale}
    if isinstance(camera, Orthographic):
        assert camera.height is not None
        changes["height"] = camera.height * scale
    return camera.model_copy(update=changes)


def distance(scene: Scene) -> float:
    """Returns the distance of the eye from the middle of the objects' origins [scene units].

    It is at least the depth of the near plane, because the eye may lie in the middle.
    """
    assembly = assemble(scene)
    middle = np.mean([instance.world_from_object[:3, 3] for instance in assembly.instances], axis=0)
    return max(float(np.linalg.norm(assembly.view.eye - middle)), abs(assembly.view.near))


def flattened(scene: Scene) -> Scene:
    """Returns the scene without parents: each object has the product of all transforms as its own."""
    by_name = {item.name: item for item in scene.objects}

    def world(item: Object) -> Array:
        own = item.transform.array()
        return own if item.parent is None else world(by_name[item.parent]) @ own

    return scene.model_copy(
        update={"objects": tuple(placed(item, world(item)).model_copy(update={"parent": None}) for item in scene.objects)}
    )


def with_meshes(scene: Scene, change: Callable[[Object], Object | None]) -> Scene:
    """Returns the scene with changes to its objects. A mesh file becomes one object for each of its parts.

    Blended objects stay as they are, because their triangles show through each other in the order in which they are drawn. So
    does a mesh file that is the parent of another object, and so do points and lines, which have no triangles.
    change: a function that takes an object whose key `mesh` is a Mesh, and returns the changed object. None leaves the object
        unchanged.
    Errors: NotApplicableError if no object is changed.
    """
    scene = written_out(scene)
    kept = blended_objects(scene)
    parents = {item.parent for item in scene.objects}
    objects: list[Object] = []
    names: dict[str, list[str]] = {}
    changed = False
    for number, item in enumerate(scene.objects):
        is_empty = item.mesh is None and item.shape is None
        if is_empty or number in kept or (item.name in parents and isinstance(item.mesh, Path)):
            objects.append(item)
            continue
        parts = pieces(scene, item)
        if item.name is not None and len(parts) > 1:
            names[item.name] = [f"{item.name}/{index}" for index in range(len(parts))]
            parts = [part.model_copy(update={"name": name}) for part, name in zip(parts, names[item.name], strict=True)]
        results = [change(part) if mesh_of(part).strokes is None else None for part in parts]
        changed = changed or any(results)
        objects += [result or part for result, part in zip(results, parts, strict=True)]
    if not changed:
        raise NotApplicableError("no object has a mesh that the law can change")
    return scene.model_copy(update={"objects": tuple(objects), "lights": _linked(scene.lights or (), names)})


def with_mesh(item: Object, mesh: Mesh) -> Object:
    """Returns the object with another mesh."""
    return item.model_copy(update={"shape": None, "mesh": mesh})


def mesh_of(item: Object) -> Mesh:
    """Returns the mesh of an object whose key `mesh` is a Mesh."""
    assert isinstance(item.mesh, Mesh)
    return item.mesh


def material_of(scene: Scene, item: Object) -> Brdf:
    """Returns the material of an object whose key `mesh` is a Mesh."""
    if isinstance(item.material, str):
        return scene.materials[item.material]
    return item.material or DEFAULT_MATERIAL


def pieces(scene: Scene, item: Object) -> list[Object]:
    """Returns an object for each mesh of an object of the scene; none for an object that only has children."""
    if item.shape is not None:
        return [with_mesh(item, item.shape.mesh())]
    if isinstance(item.mesh, Mesh):
        return [item]
    if isinstance(item.mesh, Copies):
        single = with_mesh(item, item.mesh.mesh)
        return [placed(single, item.transform.array() @ pose) for pose in item.mesh.poses]
    if item.mesh is None:
        return []
    found = []
    for part in scene.loader()(item.mesh).parts:
        piece = placed(with_mesh(item, part.mesh), item.transform.array() @ part.transform)
        found.append(piece.model_copy(update={"material": item.material or _material(part.material)}))
    return found


def _material(table: Any) -> Brdf | None:
    """Returns the material that a mesh file describes by a table; None if it describes none."""
    return BRDFS[table["brdf"]].model_validate(table) if table else None


def _linked(lights: Sequence[Light], names: dict[str, list[str]]) -> tuple[Light, ...]:
    """Returns the lights with new names of the objects that they light. names: old name -> new names."""
    return tuple(
        light
        if light.only is None
        else light.model_copy(update={"only": tuple(new for name in light.only for new in names.get(name, [name]))})
        for light in lights
    )


def blended_objects(scene: Scene) -> set[int]:
    """Returns the numbers of the objects that have a blended material."""
    return {instance.number for instance in assemble(scene).instances if instance.material.alpha_mode == "blend"}


def shaded_smoothly(scene: Scene) -> Scene:
    """Returns the scene with shading per pixel where it asks for shading per face.

    A law that changes transforms or directions changes how they are rounded to float32. The intervals of shading per face have
    no room for that, because nothing is interpolated.
    """
    rates = [scene.quality_of(item).shading or item.shading for item in scene.objects]
    if "flat" not in rates:
        return scene
    objects = tuple(
        item.model_copy(update={"shading": "phong" if rate == "flat" else rate})
        for item, rate in zip(scene.objects, rates, strict=True)
    )
    return with_quality(scene.model_copy(update={"objects": objects}), shading=None)


def with_quality(scene: Scene, **keys: Any) -> Scene:
    """Returns the scene with these keys of the quality, which no object's own quality replaces."""
    absent = dict.fromkeys(keys)
    objects = tuple(
        item.model_copy(update={"quality": item.quality.model_copy(update=absent)}) if item.quality else item
        for item in scene.objects
    )
    return scene.model_copy(update={"quality": scene.quality.model_copy(update=keys), "objects": objects})
