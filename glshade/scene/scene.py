"""Scene: the root of the document. Its classes define the file format, the JSON schema and the Python interface at once."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    Field,
    model_validator,
)

from glshade.document import Chosen, Document, nearest, value_of
from glshade.lights import LIGHTS, Light
from glshade.presets import PRESETS, preset
from glshade.scene.animation import Track
from glshade.scene.camera import CAMERAS, Camera, Perspective
from glshade.scene.film import Film
from glshade.scene.object import Material, Object
from glshade.scene.quality import Quality

Array = NDArray[np.float64]


def _items(data: Any, key: str) -> list[Any]:
    """Returns the list under a key; empty where there is none."""
    value = value_of(data, key)
    return list(value) if isinstance(value, list | tuple) else []


class Scene(Document):
    """The whole scene: its objects, materials and lights, its cameras, and the film that records the picture."""

    description: str = Field("", description="description of the scene")
    film: Film = Field(default_factory=Film)
    camera: Annotated[Camera, Chosen(CAMERAS, "type", default="perspective")] = Field(default_factory=Perspective)
    materials: dict[str, Material] = Field(
        {}, description='name -> material; `preset = "gold"` in place of brdf takes the keys it does not set from a preset'
    )
    objects: tuple[Object, ...] = Field(description="objects that are drawn")
    lights: tuple[Annotated[Light, Chosen(LIGHTS, "type")], ...] | None = Field(
        None, description="lights; left out: a key, a fill and an ambient light, placed about the camera; []: no light"
    )
    quality: Quality = Field(default_factory=Quality, description="choices between speed and accuracy")
    cameras: dict[str, Annotated[Camera, Chosen(CAMERAS, "type", default="perspective")]] = Field(
        {}, description="name -> camera: more cameras, which `glshade render --camera` chooses by name"
    )
    animation: tuple[Track, ...] = Field((), description="values that change from frame to frame")

    @model_validator(mode="before")
    @classmethod
    def _with_presets(cls, data: Any) -> Any:
        """Adds the presets that objects name to the scene's materials, so that the scene holds all its materials."""
        own = data.get("materials", {}) if isinstance(data, Mapping) else None
        if not isinstance(own, Mapping):
            return data
        named = [value_of(item, "material") for item in _items(data, "objects")]
        used = {name: preset(name) for name in named if isinstance(name, str) and name in PRESETS and name not in own}
        return {**data, "materials": {**own, **used}} if used else data

    @classmethod
    def cross_faults(cls, data: Any) -> Iterator[tuple[tuple[str | int, ...], str]]:
        objects = _items(data, "objects")
        if value_of(data, "objects") in ([], ()):
            yield ("objects",), "is empty: there is nothing to draw"
        materials = value_of(data, "materials")
        materials = materials if isinstance(materials, Mapping) else {}
        names: dict[str, int] = {}
        for index, item in enumerate(objects):
            name = value_of(item, "name")
            if isinstance(name, str):
                if name in names:
                    yield ("objects", index, "name"), f'"{name}" is already the name of objects[{names[name]}]'
                names.setdefault(name, index)
        parents = {value_of(item, "name"): value_of(item, "parent") for item in objects}
        for index, item in enumerate(objects):
            material, parent = value_of(item, "material"), value_of(item, "parent")
            if isinstance(material, str) and material not in materials and material not in PRESETS:
                yield (
                    ("objects", index, "material"),
                    f'no material or preset is named "{material}"' + nearest(material, {*materials, *PRESETS}),
                )
            if parent is None:
                continue
            if parent not in names:
                yield ("objects", index, "parent"), f'no object is named "{parent}"' + nearest(parent, names)
                continue
            chain = [value_of(item, "name")]
            while parent is not None and parent not in chain:
                chain.append(parent)
                parent = parents.get(parent)
            if parent is not None and parent == chain[0]:
                yield ("objects", index, "parent"), "a cycle: " + " -> ".join(str(link) for link in [*chain, parent])
        for index, light in enumerate(_items(data, "lights")):
            only = value_of(light, "only")
            for place, name in enumerate(only if isinstance(only, list | tuple) else ()):
                if isinstance(name, str) and name not in names:
                    yield ("lights", index, "only", place), f'no object is named "{name}"' + nearest(name, names)
