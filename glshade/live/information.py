"""Information: facts about a scene for the pages: its cameras, objects, layers and programs, as JSON types."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.assembly.assembly import Assembly
from glshade.gl.layers import light_layers
from glshade.gl.preparation import DrawCall, Prepared
from glshade.gl.program import Program
from glshade.glsl.reasoning import reasons
from glshade.image.layers import AOVS
from glshade.live.controls import material_key, object_key
from glshade.radiance.readying import ready
from glshade.scene.camera import Camera
from glshade.scene.scene import Scene

Table = dict[str, Any]


def information_of(scene: Scene, drawn: Prepared, driver: str, known: Collection[Program]) -> Table:
    """Returns facts about a scene.

    "description": its text.
    "size": [width, height] of the film [pixels].
    "layers": the names of its layers.
    "driver": the name and the version of the driver.
    "cameras": a table for each camera, the scene's own first; see `cameras`.
    "objects": a table for each object: "name", "key", "material_key" and "triangles" (their number).
    "programs": a table for each program: "name", "objects", "reasons", "milliseconds" (by step), "rebuilt" and "no_reference".

    scene: the scene.
    drawn: the scene as it was drawn.
    driver: the name and the version of the driver.
    known: the programs that were there before; the others count as rebuilt.
    """
    assembly = drawn.assembly
    return {
        "description": scene.description,
        "size": list(scene.film.size),
        "cameras": cameras(scene, drawn),
        "objects": _objects(scene, assembly),
        "layers": [name for aov in AOVS for name in (light_layers(assembly) if aov == "lights" else [aov])],
        "programs": _programs(drawn, known),
        "driver": driver,
    }


def cameras(scene: Scene, drawn: Prepared) -> list[Table]:
    """Returns the cameras of a scene at their final positions, its own first.

    A table has "name" (null for the scene's own), "type", "eye", "target", "up", "fov" (degrees, null for an orthographic one)
    and "height" (scene units, null for a perspective one). The target lies in the middle of the picture, at the depth of the
    middle of the scene.
    scene: the scene.
    drawn: a scene that was drawn. Where it is the scene itself, it need not be assembled again.
    """
    own = drawn.assembly if drawn.scene is scene else ready(scene)
    named = [
        _camera(name, ready(scene.model_copy(update={"camera": camera})), camera) for name, camera in scene.cameras.items()
    ]
    return [_camera(None, own, scene.camera), *named]


def _camera(name: str | None, assembly: Assembly, camera: Any) -> Table:
    view, unit = assembly.view, assembly.unit
    assert isinstance(camera, Camera)
    depth = max(float(view.depth(_middle(assembly))), view.near)
    # A camera that looks along its `up` has turned away from it, so the page gets the direction that is up in the picture.
    up = view.axes[1] if camera.matrix is not None else np.array(camera.up)
    return {
        "name": name,
        "type": "perspective" if view.perspective else "orthographic",
        "eye": _numbers(view.eye / unit),
        "target": _numbers((view.eye - depth * view.axes[2]) / unit),
        "up": _numbers(up),
        "fov": math.degrees(2 * math.atan(view.half_height)) if view.perspective else None,
        "height": None if view.perspective else 2 * view.half_height / unit,
    }


def _middle(assembly: Assembly) -> NDArray[np.float64]:
    """Returns the middle (3,) of a box round all instances, in the assembly's unit."""
    corners = []
    upper = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)])
    for instance in assembly.instances:
        box = instance.mesh.bounds[upper, np.arange(3)].astype(np.float64)
        corners.append(box @ instance.world_from_object[:3, :3].T + instance.world_from_object[:3, 3])
    points = np.concatenate(corners)
    middle: NDArray[np.float64] = (points.min(axis=0) + points.max(axis=0)) / 2
    return middle


def _objects(scene: Scene, assembly: Assembly) -> list[Table]:
    triangles = [0] * len(scene.objects)
    for instance in assembly.instances:
        triangles[instance.number] += len(instance.mesh.triangles)
    return [
        {
            "name": item.name or f"objects[{index}]",
            "key": object_key(index),
            "material_key": material_key(item, index),
            "triangles": triangles[index],
        }
        for index, item in enumerate(scene.objects)
    ]


def _programs(drawn: Prepared, known: Collection[Program]) -> list[Table]:
    """Returns a table for each program, in the order in which they draw."""
    calls: dict[int, list[DrawCall]] = {}
    for call in drawn.calls:
        calls.setdefault(id(call.program), []).append(call)
    tables = []
    for group in calls.values():
        first = group[0]
        why = {text: because for call in group for text, because in reasons(call.plan, call.instance, drawn.assembly)}
        tables.append(
            {
                "name": str(first.plan),
                "objects": list(dict.fromkeys(instance.name for call in group for instance in call.instances)),
                "reasons": [f"{text}: {because}" for text, because in why.items()],
                "milliseconds": {"compile and link": 1000 * first.program.seconds},
                "rebuilt": first.program not in known,
                "no_reference": not getattr(type(first.instance.material), "has_reference", True),
            }
        )
    return tables


def _numbers(vector: NDArray[np.float64]) -> list[float]:
    return [float(value) for value in vector]
