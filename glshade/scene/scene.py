"""Scene: the root of the document. Its classes define the file format, the JSON schema and the Python interface at once."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, PrivateAttr, ValidationInfo, model_validator

from glshade.brdfs import Brdf
from glshade.document import Chosen, Document, FileOrFolder, fault, nearest, resolved, value_of
from glshade.errors import AssetError
from glshade.lights import LIGHTS, Light
from glshade.limits import LONGEST_CHAIN, UNLIMITED, Limits
from glshade.mesh import file as mesh_file
from glshade.mesh.model import Model
from glshade.presets import PRESETS, preset
from glshade.scene.animation import Track
from glshade.scene.camera import CAMERAS, Camera, Intrinsics, Perspective, intrinsics
from glshade.scene.film import Film
from glshade.scene.object import Material, Object
from glshade.scene.quality import Quality
from glshade.scene.sampling import Sample
from glshade.textures.texture import Picture

Array = NDArray[np.float64]


def _items(data: Any, key: str) -> list[Any]:
    """Returns the list under a key; empty where there is none."""
    value = value_of(data, key)
    return list(value) if isinstance(value, list | tuple) else []


def _sized(film: Film, camera: Camera) -> Film:
    """Returns the film with the size of a calibrated camera; the same film where it has a size of its own."""
    if not isinstance(camera, Intrinsics) or "size" in film.model_fields_set:
        return film
    # The key does not count as set, so that another camera may bring another size.
    return Film.model_construct(film.model_fields_set, **{**dict(film), "size": (camera.width, camera.height)})


def _is_shared(value: Any, other: Any) -> bool:
    """Returns whether two values are the same object, or tuples or tables of the same objects."""
    if isinstance(value, dict) and isinstance(other, dict):
        return value.keys() == other.keys() and all(item is other[key] for key, item in value.items())
    if isinstance(value, tuple) and isinstance(other, tuple):
        return len(value) == len(other) and all(a is b for a, b in zip(value, other, strict=True))
    return value is other


def _is_in(name: Any, names: set[str]) -> bool:
    """Returns whether a value that should be a name is one of these names."""
    return isinstance(name, str) and name in names


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
    cameras_from: FileOrFolder | None = Field(
        None,
        description="file or folder with more cameras, as --cameras writes it; they are named after their pictures",
    )
    animation: tuple[Track, ...] = Field((), description="values that change from frame to frame")
    sample: Sample | None = Field(None, description="values that are drawn at random: frame n is sample n")

    # The limits under which the scene's file was read; a scene that was built in Python has none.
    _limits: Limits = PrivateAttr(UNLIMITED)
    # The contents of mesh files by their paths; None: the files are read when the scene is drawn.
    _models: Mapping[Path, Model] | None = PrivateAttr(None)

    def model_post_init(self, context: Any) -> None:
        """Stores the limits that the validation context holds under the key "limits"."""
        self._limits = (context or {}).get("limits", UNLIMITED)

    @model_validator(mode="after")
    def _with_size(self) -> "Scene":
        """Gives the film the size of a calibrated camera, unless the film has one."""
        film = _sized(self.film, self.camera)
        if film is not self.film:
            # The scene is frozen for everyone else.
            self.__dict__["film"] = film
        return self

    def __eq__(self, other: object) -> bool:
        """Compares the values of two scenes, whatever their limits."""
        return isinstance(other, Scene) and all(getattr(self, key) == getattr(other, key) for key in Scene.model_fields)

    @property
    def limits(self) -> Limits:
        """The limits of the work that the scene may ask for, and of the files that its mesh files may name."""
        return self._limits

    @property
    def models(self) -> Mapping[Path, Model] | None:
        """The contents of the scene's mesh files, by their paths; None where they are read when the scene is drawn."""
        return self._models

    def through(self, camera: Camera) -> "Scene":
        """Returns the scene through another camera.

        A calibrated camera brings its own size of the picture, unless the scene's film has one.
        """
        return self.model_copy(update={"camera": camera, "film": _sized(self.film, camera)})

    def differs_in_camera(self, other: "Scene") -> bool:
        """Returns whether two scenes share all values that a picture depends on, apart from the camera."""
        keys = ("film", "materials", "objects", "lights", "quality")
        same = all(_is_shared(getattr(self, key), getattr(other, key)) for key in keys)
        return same and self._limits == other._limits and self._models is other._models

    def quality_of(self, item: Object) -> Quality:
        """Returns the quality with which an object is drawn: its own, over the scene's."""
        return item.quality.over(self.quality) if item.quality else self.quality

    def pictures(self, known: "Scene | None" = None) -> Iterator[tuple[str, Picture]]:
        """Yields (key path, texture) for every texture that the scene itself names.

        known: optional, another scene; materials that both scenes share are left out.
        """
        shared = {id(material) for _, material in known.placed_materials()} if known else set()
        for place, material in self.placed_materials():
            if isinstance(material, Document) and id(material) not in shared:
                for name in type(material).model_fields:
                    value = getattr(material, name)
                    if isinstance(value, Picture):
                        yield f"{place}.{name}.texture", value

    def tables(self, known: "Scene | None" = None) -> Iterator[tuple[str, Brdf, str]]:
        """Yields (key path, material, name of a table) for every table that a material of the scene reads. known: as for
        `pictures`.
        """
        shared = {id(material) for _, material in known.placed_materials()} if known else set()
        for place, material in self.placed_materials():
            if isinstance(material, Brdf) and id(material) not in shared:
                yield from ((f"{place}.{key}", material, name) for name, key in material.tables.items())

    def placed_materials(self) -> Iterator[tuple[str, Any]]:
        """Yields (key path, material) for the scene's table of materials and for the material of every object."""
        yield from ((f"materials.{name}", material) for name, material in self.materials.items())
        yield from ((f"objects[{index}].material", item.material) for index, item in enumerate(self.objects))

    def loader(self) -> Callable[[Path], Model]:
        """Returns the function that loads the scene's mesh files.

        The mesh files may name other files in their own folders, and in the folders of all files that the scene names.
        """
        if self._models is not None:
            return self._models.__getitem__
        named = [item.mesh for item in self.objects if isinstance(item.mesh, Path)]
        if not named:
            return partial(mesh_file.load, limits=self._limits)
        pictures = [picture.texture for _, picture in self.pictures()]
        folders = {path.parent for path in (*named, *pictures) if isinstance(path, Path)}
        return partial(mesh_file.load, limits=self._limits, folders=frozenset(folder.resolve() for folder in folders))

    def with_models(self, models: Mapping[Path, Model]) -> "Scene":
        """Returns the scene with the contents of its mesh files, which are then no longer read when it is drawn.

        models: path -> contents, of every mesh file that the scene names.
        """
        scene = self.model_copy()
        scene._models = models
        return scene

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

    @model_validator(mode="before")
    @classmethod
    def _with_cameras(cls, data: Any, info: ValidationInfo) -> Any:
        """Adds the cameras of the file that the scene names. A camera of the scene's own keeps its name."""
        path = data.get("cameras_from") if isinstance(data, Mapping) else None
        own = data.get("cameras", {}) if isinstance(data, Mapping) else None
        if not isinstance(path, str | Path) or not isinstance(own, Mapping):
            return data
        from glshade.calibration.file import named

        try:
            found = named(resolved(Path(path), info, folders=True))
        except AssetError as error:
            raise fault("; ".join(error.problems)) from None
        return {**data, "cameras": {**{name: intrinsics(camera) for name, camera in found.items()}, **own}}

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
        parents = {name: value_of(objects[index], "parent") for name, index in names.items()}
        followed = {parent for parent in (value_of(item, "parent") for item in objects) if isinstance(parent, str)}
        for index, item in enumerate(objects):
            is_empty = value_of(item, "mesh") is None and value_of(item, "shape") is None
            # What is neither a table nor an object has a fault of its own.
            if isinstance(item, Mapping | Object) and is_empty and not _is_in(value_of(item, "name"), followed):
                yield ("objects", index), "needs a mesh or a shape: no object names it as its parent"
            material, parent = value_of(item, "material"), value_of(item, "parent")
            if isinstance(material, str) and material not in materials and material not in PRESETS:
                yield (
                    ("objects", index, "material"),
                    f'no material or preset is named "{material}"' + nearest(material, {*materials, *PRESETS}),
                )
            if not isinstance(parent, str):
                continue
            if parent not in names:
                yield ("objects", index, "parent"), f'no object is named "{parent}"' + nearest(parent, names)
                continue
            # A dict keeps the order of the chain, and looks a name up in constant time.
            chain = {value_of(item, "name"): None}
            while isinstance(parent, str) and parent not in chain and len(chain) <= LONGEST_CHAIN:
                chain[parent] = None
                parent = parents.get(parent)
            if len(chain) > LONGEST_CHAIN:
                yield ("objects", index, "parent"), f"a chain of more than {LONGEST_CHAIN} parents"
            elif parent == next(iter(chain)) and parent is not None:
                yield ("objects", index, "parent"), "a cycle: " + " -> ".join([*chain, parent])
        for index, light in enumerate(_items(data, "lights")):
            only = value_of(light, "only")
            for place, name in enumerate(only if isinstance(only, list | tuple) else ()):
                if isinstance(name, str) and name not in names:
                    yield ("lights", index, "only", place), f'no object is named "{name}"' + nearest(name, names)
