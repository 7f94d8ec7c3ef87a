"""Labels: the names and the categories of a scene's objects, as data sets tell them."""

from __future__ import annotations

from glshade.errors import SceneError
from glshade.scene.scene import Scene


def names(scene: Scene) -> list[str]:
    """Returns the name of each object of the scene; `objects[2]` for one that has none."""
    return [item.name or f"objects[{index}]" for index, item in enumerate(scene.objects)]


def object_categories(scene: Scene) -> list[str]:
    """Returns the category of each object of the scene; its name for one that has none."""
    return [item.category or name for item, name in zip(scene.objects, names(scene), strict=True)]


def categories(scene: Scene) -> list[str]:
    """Returns the categories in the order of their numbers, which begin with 1.

    They are those that the film lists, or else those of the scene's objects in their order.
    Errors: SceneError for an object whose category the film's list lacks.
    """
    listed, found = list(scene.film.categories), object_categories(scene)
    if not listed:
        return list(dict.fromkeys(found))
    for index, category in enumerate(found):
        if category not in listed and _draws(scene, index):
            raise SceneError(f"objects[{index}]: its category {category!r} is not in film.categories: add it there")
    return listed


def _draws(scene: Scene, index: int) -> bool:
    """Returns whether an object draws anything; one without mesh and shape is only the parent of others."""
    return scene.objects[index].mesh is not None or scene.objects[index].shape is not None
