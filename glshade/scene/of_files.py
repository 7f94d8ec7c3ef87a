"""Of files: the cameras and lights that the scene's mesh files hold, placed by the objects that draw these files."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import ValidationError

from glshade.document import Document
from glshade.errors import SceneError, figure
from glshade.lights import LIGHTS, Light
from glshade.mesh.model import Model
from glshade.scene.camera import CAMERAS, Array, Camera
from glshade.scene.object import Object
from glshade.scene.scene import Scene

if TYPE_CHECKING:
    from glshade.scene.override import Overrides

# The key of the override that sets `file_lights` of all objects. The option `--file-lights` is this override.
KEY = "file_lights"

# Lights that show a white surface brighter than this, or darker than its inverse, where white is 1, get a line. A scene whose
# exposure was chosen for its lights is within three stops.
FAR = 8.0

# Name of an object -> its transform to its parent's space, and the name of its parent.
Placed = Mapping[str | None, tuple[Array, str | None]]


def placed(objects: Iterable[Object]) -> Placed:
    """Returns the transform of every object with a name. The objects of a long chain of parents share these arrays."""
    return {item.name: (item.transform.array(), item.parent) for item in objects if item.name is not None}


def world(placements: Placed, item: Object) -> Array:
    """Returns the transform (4, 4) from an object to world space, through all its parents.

    Its numbers may be infinite or NaN.
    """
    result, parent = item.transform.array(), item.parent
    with np.errstate(all="ignore"):
        while parent is not None:
            transform, parent = placements[parent]
            result = transform @ result
    return result


def file_cameras(scene: Scene, load: Callable[[Path], Model]) -> dict[str, Camera]:
    """Returns the cameras of the scene's mesh files, in world space, by the names that the files give them.

    Where two objects have a camera of one name, both are named OBJECT/CAMERA.
    load: the function that loads mesh files.

    Errors: SceneError for a camera that a scene cannot have.
    """
    found = [
        (item, name, _camera(item, name, table, transform))
        for item, model, transform in _files(scene, load, every=True)
        for name, table in model.cameras.items()
    ]
    names = [name for _, name, _ in found]
    return {name if names.count(name) == 1 else f"{item.name}/{name}": camera for item, name, camera in found}


def file_lights(scene: Scene, load: Callable[[Path], Model]) -> tuple[Light, ...]:
    """Returns the lights of the mesh files whose objects ask for them by `file_lights`, in world space.

    load: the function that loads mesh files.

    Errors: SceneError for a light that a scene cannot have.
    """
    return tuple(
        _light(item, number, table, transform)
        for item, model, transform in _files(scene, load, every=False)
        for number, table in enumerate(model.lights)
    )


def remarks(scene: Scene, models: Mapping[Path, Model]) -> Iterator[str]:
    """Yields one line for each mesh file with lights that are not used without a word, or that need another exposure.

    models: the contents of mesh files, by their paths.
    """
    for item in scene.objects:
        model = models.get(item.mesh) if isinstance(item.mesh, Path) else None
        if model is None or not model.lights:
            continue
        if item.file_lights:
            yield from _exposure(scene, item, model)
        elif scene.lights is None and KEY not in item.model_fields_set:
            count = len(model.lights)
            yield (
                f"{item.mesh}: has {count} {'light' if count == 1 else 'lights'} of its own, but is drawn with the default "
                "lights; --file-lights, or file_lights = true of its object, draws it with its own"
            )


def _exposure(scene: Scene, item: Object, model: Model) -> Iterator[str]:
    """Yields a line if the lights of a mesh file show white surfaces far from white. The exposure is never changed unasked.

    The estimate is the luminance of a white surface in the middle of the file that faces all lights, which all reach it.
    """
    middle = np.mean(
        [part.transform[:3, :3] @ part.mesh.bounds.mean(axis=0) + part.transform[:3, 3] for part in model.parts], axis=0
    )
    luminance = 0.0
    for light in model.lights:
        # Within this distance a light grows no brighter, and an estimate says nothing.
        distance = max(float(np.linalg.norm(np.subtract(light["position"], middle))), 1e-3) if "position" in light else 1.0
        luminance += abs(light["intensity"]) * max(light["colour"]) / distance**2
    shown = luminance * 2.0**scene.film.exposure
    if shown > 0 and not 1 / FAR <= shown <= FAR:
        yield (
            f"{item.mesh}: its lights give a white surface about {luminance:.3g} cd/m^2; at the scene's exposure "
            f"{scene.film.exposure:g} that is {shown:.3g} times white; --set film.exposure={-np.log2(luminance):.1f} "
            "shows it as white"
        )


def chosen(document: Any, overrides: Overrides) -> tuple[Any, Overrides]:
    """Returns the document and the overrides without those of the key `file_lights`, which is set in objects with mesh files.

    document: the table of a scene.
    """
    pairs = list(overrides.items() if isinstance(overrides, Mapping) else overrides)
    values = [value for key, value in pairs if key == KEY]
    if not values or not isinstance(document, Mapping) or not isinstance(document.get("objects"), list):
        return document, overrides
    value = values[-1] in (True, "true")
    objects = [{**item, KEY: value} if isinstance(item, Mapping) and "mesh" in item else item for item in document["objects"]]
    return {**document, "objects": objects}, [pair for pair in pairs if pair[0] != KEY]


def _files(scene: Scene, load: Callable[[Path], Model], every: bool) -> Iterator[tuple[Object, Model, Array]]:
    """Yields (object, contents of its mesh file, transform to world space) for the objects with mesh files.

    every: whether objects without `file_lights` are included.
    """
    wanted = [item for item in scene.objects if isinstance(item.mesh, Path) and (every or item.file_lights)]
    placements = placed(scene.objects) if wanted else {}
    for item in wanted:
        assert isinstance(item.mesh, Path)
        yield item, load(item.mesh), world(placements, item)


def _camera(item: Object, name: str, table: Mapping[str, Any], transform: Array) -> Camera:
    """Returns a camera of a mesh file.

    transform: (4, 4) from file space to world space. Its scale multiplies the lengths of the camera, which then shows the file
        as before.

    Errors: SceneError.
    """
    matrix = transform @ np.array(table["matrix"])
    size = float(np.cbrt(abs(np.linalg.det(transform[:3, :3]))))
    given = {key: value * size if key in ("near", "far", "height") else value for key, value in table.items()}
    given["matrix"] = turned(matrix).tolist()
    made = _validated(CAMERAS[table["type"]], given, f"{item.mesh}: camera {name}")
    assert isinstance(made, Camera)
    return made


def turned(matrix: Array) -> Array:
    """Returns the transform (4, 4) of a camera without scale, shear and mirroring: it only turns and moves.

    The camera keeps its position, its direction of view, and the plane in which its up direction lies.
    """
    result = np.eye(4)
    backward = matrix[:3, 2] / np.linalg.norm(matrix[:3, 2])
    right = np.cross(matrix[:3, 1], backward)
    right /= np.linalg.norm(right)
    result[:3, :3] = np.stack([right, np.cross(backward, right), backward], axis=1)
    result[:3, 3] = matrix[:3, 3]
    return result


def _light(item: Object, number: int, table: Mapping[str, Any], transform: Array) -> Light:
    """Returns a light of a mesh file. transform: (4, 4) from file space to world space. Errors: SceneError.

    A scale of the object moves the light and leaves its intensity, as in KHR_lights_punctual.
    """
    given = dict(table)
    if "position" in given:
        given["position"] = (transform[:3, :3] @ given["position"] + transform[:3, 3]).tolist()
    if "direction" in given:
        given["direction"] = (transform[:3, :3] @ given["direction"]).tolist()
    made = _validated(LIGHTS[given["type"]], given, f"{item.mesh}: light {number}")
    assert isinstance(made, Light)
    return made


def _validated(kind: type[Document], table: Mapping[str, Any], place: str) -> Document:
    """Returns the document of a table. place: what the table is, for messages. Errors: SceneError."""
    try:
        return kind.model_validate(table)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key, value = ".".join(map(str, first["loc"])), first["input"]
        shown = figure(value) if isinstance(value, float) else str(value)[:100]
        raise SceneError(f"{place}: {key} = {shown}: {first['msg']}") from None
