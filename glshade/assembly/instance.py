"""Instance: one mesh with its transform, its material, its shading rate and the lights that reach it."""

from __future__ import annotations

from dataclasses import dataclass, replace
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
class Share:
    """The light that some of an instance's lights make on it.

    material: the material with the colours that it has in these lights.
    lights: indices in the assembly's lights.
    weights: matrix (3, 3) that turns the light of the material's three bands into RGB; None for a material of RGB colours.
    """

    material: Brdf
    lights: tuple[int, ...]
    weights: Array | None = None


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
    shares: what lights of several spectra, or the bands of a spectrum, add to the instance's light; empty for an instance with
        one material for all its lights. An instance with shares has its colours under D65 as its material.
    weights: as in `Share`, for an instance that stands for one of the shares of another.
    written: the material with its spectra; None in a scene without spectra.
    said: (feature, name of what requires it) for each way in which spectra change how the instance is drawn.
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
    shares: tuple[Share, ...] = ()
    weights: Array | None = None
    written: Brdf | None = None
    said: tuple[tuple[str, str], ...] = ()

    @cached_property
    def mirrored(self) -> bool:
        """Whether the transform mirrors, which turns counter-clockwise triangles into clockwise ones."""
        return bool(np.linalg.det(self.world_from_object[:3, :3]) < 0)

    @property
    def has_bands(self) -> bool:
        """Whether any of its light is drawn in bands of wavelengths, whose weights are negative in part."""
        return any(share.weights is not None for share in self.shares)

    @property
    def parts(self) -> tuple[Instance, ...]:
        """The instances whose light is added: one for each share, or the instance itself."""
        return self._of_shares if self.shares else (self,)

    @cached_property
    def _of_shares(self) -> tuple[Instance, ...]:
        alone = replace(self, shares=())
        return tuple(replace(alone, **vars(share)) for share in self.shares)
