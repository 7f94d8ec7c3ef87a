"""Instance: one mesh with its transform, its material, its shading rate and the lights that reach it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from glshade.brdfs import Brdf
from glshade.mesh.mesh import Mesh
from glshade.scene.object import Rate
from glshade.scene.quality import Quality

Array = NDArray[np.float64]

# The value that an instance writes to the picture. "depth" writes the instance's number too.
Shows = Literal["light", "depth", "uv", "normal"]


@dataclass(frozen=True, eq=False)
class Instance:
    """One mesh of an object, with everything that is needed to draw it.

    name: the object's name, for messages.
    mesh: the mesh, ready for its shading rate: faceted if flat, subdivided, and with tangents where they are needed.
    world_from_object: transform (4, 4) float64 of positions relative to the mesh's origin.
    material: the material, simplified as far as the lights and the quality allow.
    rate: the shading rate, with the quality applied.
    back_faces: whether back faces are drawn.
    vertex_colours: whether the mesh's vertex colours multiply the base colour.
    lights: the indices, in the assembly's lights, of the lights that reach the instance.
    quality: the object's quality, with the scene's values for the keys that the object leaves out.
    number: index of the object in the scene; index of the instance in the assembly if it shows depth, uv or normal.
    made_of: the material's name, or the name of the first object or part that has the material.
    shows: the value that the instance writes to the picture: its light, or a property of its surface.
    source: the model of the mesh file, or the mesh before it was made ready. The instance keeps it in memory, so that it is
        neither read nor made again while the instance exists.
    """

    name: str
    mesh: Mesh
    world_from_object: Array
    material: Brdf
    rate: Rate
    back_faces: bool
    vertex_colours: bool
    lights: tuple[int, ...]
    quality: Quality
    number: int
    made_of: str
    shows: Shows = "light"
    source: object = None

    @cached_property
    def mirrored(self) -> bool:
        """Whether the transform mirrors, which turns counter-clockwise triangles into clockwise ones."""
        return bool(np.linalg.det(self.world_from_object[:3, :3]) < 0)
