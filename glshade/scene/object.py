"""Object: the keys of what a scene draws: meshes and shapes, their transforms, materials and shading."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    AfterValidator,
    BeforeValidator,
    Discriminator,
    Field,
    Tag,
    WithJsonSchema,
)

from glshade.brdfs import BRDFS, Brdf
from glshade.document import AsIs, Chosen, Document, File, Triple, Vector3, fault, value_of
from glshade.errors import AssetError
from glshade.image.srgb import srgb_to_linear
from glshade.mesh.copies import Copies
from glshade.mesh.formats import SUFFIXES
from glshade.mesh.mesh import Mesh
from glshade.presets import FromPreset
from glshade.scene.camera import Matrix4, affine
from glshade.scene.quality import Quality
from glshade.scene.shape import SHAPES, Shape

Array = NDArray[np.float64]
Rate = Literal["flat", "gouraud", "phong"]
Normals = Literal["auto", "face", "smooth"]
Sides = Literal["auto", "front", "both"]


def _scale(value: Vector3) -> Vector3:
    if 0.0 in value:
        raise fault(f"must not be zero along any axis, not {list(value)}: it flattens the object")
    return value


class Transform(Document):
    """The transform from the object's space to world space, or to the parent's space.

    The object is scaled, then turned about x, then about y, then about z, then moved. A matrix may be given instead.
    """

    translate: Vector3 = Field((0.0, 0.0, 0.0), description="moves the object [scene units]")
    rotate: Vector3 = Field((0.0, 0.0, 0.0), description="angles about x, then y, then z [degrees]")
    scale: Annotated[Triple, AfterValidator(_scale)] = Field(
        (1.0, 1.0, 1.0), description="scales the object along each axis; a negative number mirrors it"
    )
    matrix: Annotated[Matrix4, AfterValidator(affine)] | None = Field(
        None, description="replaces translate, rotate and scale: rows top to bottom, for column vectors"
    )

    @classmethod
    def cross_faults(cls, data: Any) -> Iterable[tuple[tuple[str | int, ...], str]]:
        if isinstance(data, Mapping) and data.get("matrix") is not None:
            for key in ("translate", "rotate", "scale"):
                if key in data:
                    yield (key,), "cannot be used together with matrix, which replaces it"

    def array(self) -> Array:
        """Returns the transform as a matrix (4, 4) float64, for column vectors."""
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
    """Returns a Mesh made of a trimesh.Trimesh, of another object with vertices and faces, or of a pair (vertices, faces).

    A Mesh, Copies of one and a path are returned as they are.
    """
    if isinstance(value, Mesh | Copies | str | Path):
        return value
    uvs = colours = None
    if hasattr(value, "vertices") and hasattr(value, "faces"):
        # The normals are not taken. trimesh may have computed them itself, and then they cannot be told from given ones.
        vertices, faces = np.asarray(value.vertices), np.asarray(value.faces)
        visual: Any = getattr(value, "visual", None)
        uvs, kind = getattr(visual, "uv", None), getattr(visual, "kind", None)
        if kind in ("vertex", "face"):
            # trimesh stores colours as bytes, which by convention are sRGB-encoded.
            encoded = np.asarray(visual.vertex_colors if kind == "vertex" else visual.face_colors) / 255
            colours = np.column_stack([srgb_to_linear(encoded[:, :3]), encoded[:, 3]])
        if kind == "face" and colours is not None:
            vertices, colours = vertices[faces].reshape(-1, 3), np.repeat(colours, 3, axis=0)
            faces = np.arange(len(vertices)).reshape(-1, 3)
    elif isinstance(value, tuple | list) and len(value) == 2:
        vertices, faces = value
    else:
        raise fault(
            "must be the path of a mesh file (or, in Python, a Mesh, Copies, a trimesh or a pair of vertices and faces)"
        )
    try:
        return Mesh.build(np.asarray(vertices), np.asarray(faces), None, uvs, colours)
    except AssetError as error:
        raise fault("; ".join(error.problems)) from None


def _mesh_branch(value: Any) -> str:
    """Returns the tag of the union branch that validates the value. The tags are those of `document.BRANCHES`."""
    return "<value>" if isinstance(value, Mesh | Copies) else "<texture-table>"


MeshSource = Annotated[
    Annotated[Mesh | Copies, AsIs(), Tag("<value>")] | Annotated[File, Tag("<texture-table>")],
    Discriminator(_mesh_branch),
    WithJsonSchema({"type": "string", "format": "path"}),
]


Material = Annotated[Brdf, Chosen(BRDFS, "brdf"), FromPreset()]


def _material_branch(value: Any) -> str:
    """Returns the tag of the union branch that validates the value. The tags are those of `document.BRANCHES`."""
    return "<shorthand>" if isinstance(value, str) else "<table>"


MESH_FILES = f"mesh file: {', '.join(SUFFIXES)}"


class Object(Document):
    """Something to draw: a mesh or a shape, with its transform, its material and its shading.

    An object without mesh and shape draws nothing. Its transform applies to the objects that name it as their parent.
    """

    name: str | None = Field(None, description="name of the object, for lights, parents, dotted keys and messages")
    mesh: Annotated[MeshSource, BeforeValidator(_mesh)] | None = Field(None, description=MESH_FILES)
    shape: Annotated[Shape, Chosen(SHAPES, "type", shorthand=True)] | None = Field(
        None, description="primitive that is drawn in place of a mesh file"
    )
    transform: Transform = Field(default_factory=Transform)
    parent: str | None = Field(None, description="name of the object whose transform is applied after this one's")
    material: (
        Annotated[Annotated[str, Tag("<shorthand>")] | Annotated[Material, Tag("<table>")], Discriminator(_material_branch)]
        | None
    ) = Field(
        None,
        description="name of a material or a preset, or a table of its own; left out: the mesh file's own, else grey phong",
    )
    shading: Rate = Field("phong", description="the model is evaluated once per face, per vertex or per pixel")
    normals: Normals = Field(
        "auto", description="normals of faces, or smooth up to the threshold; auto: the mesh's own, smooth where it has none"
    )
    threshold: Annotated[float, Field(ge=0, le=180)] = Field(
        40.0, description="least angle between two faces at which their edge is sharp; at 180 no edge is sharp [degrees]"
    )
    sides: Sides = Field(
        "auto",
        description="front: back faces are culled; both: where the back is seen, the normal is reversed; auto: front if closed",
    )
    category: str | None = Field(
        None, description="kind of the object in data sets: for the layer semantic_id and --coco; left out: the object's name"
    )
    vertex_colours: bool = Field(True, description="whether the mesh's vertex colours multiply the base colour")
    file_lights: bool = Field(
        False,
        description="whether the lights of its mesh file shine, in lux and candela: the radiance 1 is then 1 cd/m^2",
    )
    quality: Quality | None = Field(None, description="replaces the scene's quality key by key; storage is not allowed here")

    @property
    def own_mesh(self) -> Mesh | None:
        """The mesh that the object holds itself, at one or several places; None where it names a file or has a shape."""
        return self.mesh.mesh if isinstance(self.mesh, Copies) else self.mesh if isinstance(self.mesh, Mesh) else None

    @classmethod
    def cross_faults(cls, data: Any) -> Iterable[tuple[tuple[str | int, ...], str]]:
        if isinstance(data, Mapping) and data.get("mesh") is not None and data.get("shape") is not None:
            yield (), "has a mesh and a shape; an object draws one of them"
        if value_of(value_of(data, "quality"), "storage") is not None:
            yield ("quality", "storage"), "applies to the whole picture: set it in the scene's own [quality]"
