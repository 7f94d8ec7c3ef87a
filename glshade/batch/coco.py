"""COCO: writes the boxes and masks of the objects in a batch's pictures to one JSON file, as pycocotools reads it."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from glshade.batch.task import Task
from glshade.errors import GlshadeError
from glshade.files import replacing

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from glshade.scene.scene import Scene


def instances(scene: Scene, numbers: NDArray[Any]) -> dict[str, Any]:
    """Returns the objects that a picture shows, as JSON types.

    scene: the scene of the picture.
    numbers: (H, W), the index of the object in each pixel, -1 for none.
    Errors: SceneError for an object whose category the film's list lacks.
    """
    from glshade.image.masks import object_masks
    from glshade.scene import labels

    names, categories = labels.names(scene), labels.object_categories(scene)
    labels.categories(scene)
    shown = [
        {"name": names[number - 1], "category": categories[number - 1], **mask}
        for number, mask in object_masks(numbers + 1).items()
    ]
    height, width = numbers.shape
    return {"width": width, "height": height, "categories": list(scene.film.categories), "objects": shown}


def write(path: Path, tasks: Sequence[Task], found: Mapping[int, Mapping[str, Any]]) -> list[str]:
    """Writes a JSON file of the pictures that exist, in the order of their tasks, and returns the pictures that are left out.

    path: the JSON file.
    tasks: all pictures of the batch.
    found: number of a task -> what `instances` returned for it.
    Errors: GlshadeError where the file cannot be written.
    """
    there = [task for task in tasks if os.path.exists(task.output)]
    told = [(task, found[task.number]) for task in there if task.number in found]
    categories = _categories([picture for _, picture in told])
    folder = os.path.dirname(os.path.abspath(path))
    data = {
        "info": {"description": "drawn by glshade"},
        "images": [_image(task, picture, folder) for task, picture in told],
        "annotations": list(_annotations(told, categories)),
        "categories": [{"id": number, "name": name} for name, number in categories.items()],
    }
    try:
        with replacing(path) as temporary:
            temporary.write_text(json.dumps(data, separators=(",", ":")) + "\n", encoding="utf-8")
    except OSError as error:
        raise GlshadeError(f"{path}: cannot be written: {error.strerror or error}") from None
    return [task.output for task in there if task.number not in found]


def _categories(pictures: Sequence[Mapping[str, Any]]) -> dict[str, int]:
    """Returns category -> number from 1: first those that the films list, in that order, then the others by the alphabet."""
    listed = [name for picture in pictures for name in picture.get("categories", ())]
    others = sorted({item["category"] for picture in pictures for item in picture.get("objects", ())})
    return {name: number for number, name in enumerate(dict.fromkeys([*listed, *others]), start=1)}


def _image(task: Task, picture: Mapping[str, Any], folder: str) -> dict[str, Any]:
    """Returns COCO's entry of a picture. folder: the folder of the JSON file, from which the picture's path starts."""
    name = Path(os.path.relpath(os.path.abspath(task.output), folder)).as_posix()
    return {"id": task.number + 1, "file_name": name, "width": picture["width"], "height": picture["height"]}


def _annotations(told: Sequence[tuple[Task, Mapping[str, Any]]], categories: Mapping[str, int]) -> Iterator[dict[str, Any]]:
    """Yields COCO's entry of each object in each picture. categories: category -> number."""
    number = 0
    for task, picture in told:
        for item in picture.get("objects", ()):
            number += 1
            yield {
                "id": number,
                "image_id": task.number + 1,
                "category_id": categories[item["category"]],
                "name": item["name"],
                "bbox": item["bbox"],
                "area": item["area"],
                "iscrowd": 0,
                "segmentation": {"size": [picture["height"], picture["width"]], "counts": item["counts"]},
            }
