"""Scene: everything a picture is made of. These models are the file format, its JSON schema and the Python interface."""

import math
from collections.abc import Iterable, Iterator, Mapping
from numbers import Integral
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    AfterValidator,
    BeforeValidator,
    Discriminator,
    Field,
    SkipValidation,
    Tag,
    ValidationInfo,
    WithJsonSchema,
    model_validator,
)

from glshade.brdfs import BRDFS, Brdf
from glshade.document import Chosen, Document, File, Finite, Triple, Vector3, fault, nearest, number, resolved
from glshade.errors import AssetError
from glshade.image.layers import AOVS
from glshade.image.srgb import srgb_to_linear
from glshade.lights import LIGHTS, Light
from glshade.mesh.mesh import Mesh
from glshade.presets import PRESETS, FromPreset, preset
from glshade.scene.animation import Track
from glshade.scene.camera import CAMERAS, Camera, Matrix4, Perspective, affine
from glshade.scene.quality import Quality
from glshade.scene.shape import SHAPES, Shape

Array = NDArray[np.float64]
Rate = Literal["flat", "gouraud", "phong"]
Normals = Literal["auto", "face", "smooth"]
Sides = Literal["auto", "front", "both"]
# The largest side of a picture: 2^17 pixels of 16 bytes in one row are 2 MiB, still a file that other programs open.
LARGEST_SIDE = 131072
Side = Annotated[int, Field(ge=1, le=LARGEST_SIDE), BeforeValidator(number)]
Corner = Annotated[int, Field(ge=0, lt=LARGEST_SIDE), BeforeValidator(number)]
# 16 x 16 pictures take 256 times as long as one: a larger number is a slip of the pen.
LARGEST_SUPERSAMPLE = 16


def _scale(value: Vector3) -> Vector3:
    if 0.0 in value:
        raise fault(f"must not be zero along any axis, not {list(value)}: it flattens the object")
    return value


class Transform(Document):
    """world from object (or from parent): scaled, then turned about x, then y, then z, then moved; or a matrix."""

    translate: Vector3 = Field((0.0, 0.0, 0.0), description="[scene units]")
    rotate: Vector3 = Field((0.0, 0.0, 0.0), description="about x, then y, then z [degrees]")
    scale: Annotated[Triple, AfterValidator(_scale)] = Field((1.0, 1.0, 1.0), description="negative mirrors")
    matrix: Annotated[Matrix4, AfterValidator(affine)] | None = Field(
        None, description="in place of the three: rows top to bottom, column vectors"
    )

    @classmethod
    def cross_faults(cls, data: Any) -> Iterable[tuple[tuple[str | int, ...], str]]:
        if isinstance(data, Mapping) and data.get("matrix") is not None:
            for key in ("translate", "rotate", "scale"):
                if key in data:
                    yield (key,), "not together with matrix, which says it all"

    def array(self) -> Array:
        """(4, 4) float64."""
        if self.matrix is not None:
            return np.array(self.matrix)
        result = np.eye(4)
        (cx, cy, cz), (sx, sy, sz) = ([f(math.radians(a)) for a in self.rotate] for f in (math.cos, math.sin))
        about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
        about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
        about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
        result[:3, :3] = about_z @ about_y @ about_x * np.array(self.scale)
        result[:3, 3] = self.translate
        return result


def _mesh(value: Any) -> Any:
    """A mesh made in Python: a Mesh, trimesh's Trimesh (anything with vertices and faces), or (vertices, faces)."""
    if isinstance(value, Mesh | str | Path):
        return value
    uvs = colours = None
    if hasattr(value, "vertices") and hasattr(value, "faces"):
        # Its normals are not taken: trimesh computes them when it is asked, and then they look like its own.
        vertices, faces = np.asarray(value.vertices), np.asarray(value.faces)
        visual: Any = getattr(value, "visual", None)
        uvs, kind = getattr(visual, "uv", None), getattr(visual, "kind", None)
        if kind in ("vertex", "face"):
            # trimesh holds bytes, sRGB-encoded by custom.
            encoded = np.asarray(visual.vertex_colors if kind == "vertex" else visual.face_colors) / 255
            colours = np.column_stack([srgb_to_linear(encoded[:, :3]), encoded[:, 3]])
        if kind == "face" and colours is not None:
            vertices, colours = vertices[faces].reshape(-1, 3), np.repeat(colours, 3, axis=0)
            faces = np.arange(len(vertices)).reshape(-1, 3)
    elif isinstance(value, tuple | list) and len(value) == 2:
        vertices, faces = value
    else:
        raise fault("must be the path of a mesh file (or, in Python, a Mesh, a trimesh or a pair of vertices and faces)")
    try:
        return Mesh.build(np.asarray(vertices, dtype=np.float64), np.asarray(faces), None, uvs, colours)
    except AssetError as error:
        raise fault("; ".join(error.problems)) from None


def _mesh_branch(value: Any) -> str:
    return "<value>" if isinstance(value, Mesh) else "<texture-table>"


MeshSource = Annotated[
    Annotated[SkipValidation[Mesh], Tag("<value>")] | Annotated[File, Tag("<texture-table>")],
    Discriminator(_mesh_branch),
    WithJsonSchema({"type": "string", "format": "path"}),
]
Material = Annotated[Brdf, Chosen(BRDFS, "brdf"), FromPreset()]


def _material_branch(value: Any) -> str:
    return "<shorthand>" if isinstance(value, str) else "<table>"


class Object(Document):
    """Something to draw: a mesh (or a shape), where it is, what it is made of, and how it is shaded."""

    name: str | None = Field(None, description="for light linking, parents and messages")
    mesh: Annotated[MeshSource, BeforeValidator(_mesh)] | None = Field(None, description="mesh file: OBJ, PLY, STL, OFF, glTF")
    shape: Annotated[Shape, Chosen(SHAPES, "type", shorthand=True)] | None = Field(None, description="or a primitive")
    transform: Transform = Field(default_factory=Transform)
    parent: str | None = Field(None, description="name of the object whose transform comes after this one's")
    material: (
        Annotated[Annotated[str, Tag("<shorthand>")] | Annotated[Material, Tag("<table>")], Discriminator(_material_branch)]
        | None
    ) = Field(
        None,
        description="name of a material or a preset, or a material in place; left out: the mesh file's own, else grey phong",
    )
    shading: Rate = Field("phong", description="where the model is evaluated: per face, per vertex or per pixel")
    normals: Normals = Field("auto", description="face; smooth up to the threshold; auto: the mesh's own where it has them")
    threshold: Annotated[float, Field(ge=0, le=180)] = Field(
        60.0, description="smooth: an edge is sharp where its faces' normals differ by more [degrees]"
    )
    sides: Sides = Field("auto", description="front: back faces are culled; both: normals turn to the viewer; auto: what fits")
    vertex_colours: bool = Field(True, description="whether the mesh's vertex colours multiply the base colour")
    quality: Quality | None = Field(None, description="its own, before the scene's; not storage, which all objects share")

    @classmethod
    def cross_faults(cls, data: Any) -> Iterable[tuple[tuple[str | int, ...], str]]:
        if isinstance(data, Mapping) and (data.get("mesh") is None) == (data.get("shape") is None):
            yield (), "needs a mesh or a shape, and not both"
        if _get(_get(data, "quality"), "storage") is not None:
            yield ("quality", "storage"), "is the whole picture's: it belongs into the scene's own [quality]"


def _colour_with_alpha(value: tuple[float, ...]) -> tuple[float, ...]:
    if len(value) not in (3, 4):
        raise fault(f"must be 3 numbers, or 4 with alpha, not {len(value)}")
    if len(value) == 4 and not 0 <= value[3] <= 1:
        raise fault(f"alpha must be from 0 to 1, not {value[3]:g}")
    return value


def _configuration(value: Any, info: ValidationInfo) -> Any:
    """A file, or the name of one that OpenColorIO carries itself."""
    if not isinstance(value, str | Path) or str(value).startswith("ocio://"):
        return value
    return resolved(Path(value), info)


def _aov(value: str) -> str:
    if value not in AOVS:
        raise fault(f"unknown layer {value!r}" + nearest(value, AOVS))
    return value


Aov = Annotated[str, AfterValidator(_aov), WithJsonSchema({"enum": list(AOVS)})]


class Film(Document):
    """What the picture is recorded on."""

    size: tuple[Side, Side] = Field((512, 512), description="width, height [pixels]")
    crop: tuple[Corner, Corner, Side, Side] | None = Field(
        None,
        description="x, y, width, height from the top left [pixels]: only this window is drawn, to the same bits",
    )
    samples: Literal[1, 2, 4, 8] = Field(1, description="samples a pixel for smooth edges, resolved in linear light")
    supersample: Annotated[int, Field(ge=1, le=LARGEST_SUPERSAMPLE), BeforeValidator(number)] = Field(
        1,
        description="n: the mean, in linear light, of n x n pictures shifted within the pixel; smooths shading and edges",
    )
    background: Annotated[tuple[Finite, ...], AfterValidator(_colour_with_alpha)] = Field(
        (0.0, 0.0, 0.0),
        description="linear Rec. 709; with a fourth number, straight alpha, the picture has alpha too",
    )
    encoding: Literal["srgb", "linear"] = Field("srgb", description="of 8-bit pictures; EXR is always linear")
    exposure: Annotated[float, Field(ge=-64, le=64)] = Field(0.0, description="doubles all light [stops]")
    view: str | None = Field(
        None, description="OpenColorIO view through which 8-bit pictures are seen; left out beside a display: its default"
    )
    display: str | None = Field(None, description="OpenColorIO display that they are for; left out beside a view: the default")
    ocio: Annotated[Path | str, BeforeValidator(_configuration)] | None = Field(
        None, description="OpenColorIO configuration, a file or ocio://NAME; left out: $OCIO, else OpenColorIO's own default"
    )
    aovs: tuple[Aov, ...] = Field((), description="layers beside the picture: docs/layers.md says what each is")

    @classmethod
    def cross_faults(cls, data: Any) -> Iterable[tuple[tuple[str | int, ...], str]]:
        size, crop = _get(data, "size") or cls.model_fields["size"].default, _get(data, "crop")
        if _whole_numbers(size, 2) and _whole_numbers(crop, 4):
            (width, height), (x, y, w, h) = size, crop
            if x + w > width or y + h > height:
                yield ("crop",), f"reaches to {x + w}, {y + h}, beyond the picture, which is {width} x {height}"
        transformed = _get(data, "view") is not None or _get(data, "display") is not None
        if _get(data, "ocio") is not None and not transformed:
            yield ("ocio",), "says nothing without a view or a display"
        if transformed and _get(data, "encoding") == "linear":
            yield ("encoding",), "linear does not go together with a view transform, which encodes"

    @property
    def window(self) -> tuple[int, int, int, int]:
        """x, y, width, height [pixels] of what is drawn: the crop, else the whole."""
        return self.crop or (0, 0, *self.size)

    @property
    def transformed(self) -> bool:
        """Whether 8-bit pictures go through a view transform."""
        return self.view is not None or self.display is not None

    @property
    def pictures(self) -> int:
        """How many samples of any kind a pixel is the mean of."""
        return self.samples * self.supersample**2

    @property
    def direct(self) -> bool:
        """Whether a surface's 8-bit numbers are those of the picture: nothing is averaged or transformed in between."""
        return self.pictures == 1 and len(self.background) == 3 and not self.transformed


def _whole_numbers(value: Any, count: int) -> bool:
    return isinstance(value, list | tuple) and len(value) == count and all(isinstance(item, Integral) for item in value)


def _get(item: Any, key: str) -> Any:
    return item.get(key) if isinstance(item, Mapping) else getattr(item, key, None)


def _items(data: Any, key: str) -> list[Any]:
    value = _get(data, key)
    return list(value) if isinstance(value, list | tuple) else []


class Scene(Document):
    """The whole: what is drawn, what it is made of, what lights it, who looks, and on what it is recorded."""

    description: str = Field("", description="what there is to see")
    film: Film = Field(default_factory=Film)
    camera: Annotated[Camera, Chosen(CAMERAS, "type", default="perspective")] = Field(default_factory=Perspective)
    materials: dict[str, Material] = Field(
        {}, description='name -> material; `preset = "gold"` in place of its brdf: the keys of a preset where it has no other'
    )
    objects: tuple[Object, ...] = Field(description="what is drawn")
    lights: tuple[Annotated[Light, Chosen(LIGHTS, "type")], ...] | None = Field(
        None, description="left out: a key light, a fill and a little ambient, placed about the camera; [] is darkness"
    )

    quality: Quality = Field(default_factory=Quality, description="what is traded for speed")
    cameras: dict[str, Annotated[Camera, Chosen(CAMERAS, "type", default="perspective")]] = Field(
        {}, description="name -> camera: others to look through, by `glshade render --camera`"
    )
    animation: tuple[Track, ...] = Field((), description="what changes from frame to frame")

    @model_validator(mode="before")
    @classmethod
    def _with_presets(cls, data: Any) -> Any:
        """Presets that objects name become materials of the scene: it says all that it is made of."""
        own = data.get("materials", {}) if isinstance(data, Mapping) else None
        if not isinstance(own, Mapping):
            return data
        named = [_get(item, "material") for item in _items(data, "objects")]
        used = {name: preset(name) for name in named if isinstance(name, str) and name in PRESETS and name not in own}
        return {**data, "materials": {**own, **used}} if used else data

    @classmethod
    def cross_faults(cls, data: Any) -> Iterator[tuple[tuple[str | int, ...], str]]:
        objects = _items(data, "objects")
        if _get(data, "objects") in ([], ()):
            yield ("objects",), "is empty: there is nothing to draw"
        materials = _get(data, "materials")
        materials = materials if isinstance(materials, Mapping) else {}
        names: dict[str, int] = {}
        for index, item in enumerate(objects):
            name = _get(item, "name")
            if isinstance(name, str):
                if name in names:
                    yield ("objects", index, "name"), f'"{name}" is already the name of objects[{names[name]}]'
                names.setdefault(name, index)
        parents = {_get(item, "name"): _get(item, "parent") for item in objects}
        for index, item in enumerate(objects):
            material, parent = _get(item, "material"), _get(item, "parent")
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
            chain = [_get(item, "name")]
            while parent is not None and parent not in chain:
                chain.append(parent)
                parent = parents.get(parent)
            if parent is not None and parent == chain[0]:
                yield ("objects", index, "parent"), "a cycle: " + " -> ".join(str(link) for link in [*chain, parent])
        for index, light in enumerate(_items(data, "lights")):
            only = _get(light, "only")
            for place, name in enumerate(only if isinstance(only, list | tuple) else ()):
                if isinstance(name, str) and name not in names:
                    yield ("lights", index, "only", place), f'no object is named "{name}"' + nearest(name, names)
