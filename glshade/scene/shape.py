"""Shape: the keys of primitives in a scene file. glshade/mesh/primitives.py makes their meshes."""

from typing import Annotated, Literal

from pydantic import Field

from glshade.document import Document
from glshade.lru import WeakLru
from glshade.mesh import primitives
from glshade.mesh.mesh import Mesh

# The most memory that the cache of meshes may take beside the meshes that are in use [bytes].
REMEMBERED = 64 << 20

Segments = Annotated[int, Field(ge=3, le=4096)]


class Shape(Document):
    """A primitive of unit size about the origin."""

    type: str

    @property
    def triangle_count(self) -> int:
        """The number of triangles of the shape, known before its mesh is made."""
        raise NotImplementedError

    def mesh(self) -> Mesh:
        """Returns the mesh of the shape. Equal shapes share one Mesh for as long as it is in use or in the LRU cache."""
        return _meshes.find(self, self._made, lambda mesh: mesh.nbytes)

    def _made(self) -> Mesh:
        return primitives.PRIMITIVES[self.type](**self.model_dump(exclude={"type"}))


_meshes: WeakLru[Shape, Mesh] = WeakLru(REMEMBERED)


class Sphere(Shape):
    """A sphere of radius 1 with texture coordinates, whose poles lie on the y axis."""

    type: Literal["sphere"] = "sphere"
    segments: Segments = Field(96, description="number of segments round the y axis")
    rings: Annotated[int, Field(ge=2, le=4096)] = Field(48, description="number of rings from pole to pole")

    @property
    def triangle_count(self) -> int:
        return 2 * self.segments * (self.rings - 1)


class Icosphere(Shape):
    """A sphere of radius 1 whose triangles have almost the same size."""

    type: Literal["icosphere"] = "icosphere"
    subdivisions: Annotated[int, Field(ge=0, le=9)] = Field(4, description="n: the sphere has 20 x 4^n triangles")

    @property
    def triangle_count(self) -> int:
        return 20 << 2 * self.subdivisions


class Cube(Shape):
    """A cube from -1 to 1 along each axis."""

    type: Literal["cube"] = "cube"

    @property
    def triangle_count(self) -> int:
        return 12


class Plane(Shape):
    """A square at y = 0 that faces up, from -1 to 1 along x and z."""

    type: Literal["plane"] = "plane"
    segments: Annotated[int, Field(ge=1, le=4096)] = Field(1, description="number of segments along each side")

    @property
    def triangle_count(self) -> int:
        return 2 * self.segments**2


class Torus(Shape):
    """A torus round the y axis. The middle of its tube is a circle of radius 1."""

    type: Literal["torus"] = "torus"
    minor: Annotated[float, Field(gt=0, lt=1)] = Field(0.4, description="radius of the tube")
    segments: Segments = Field(96, description="number of segments round the y axis")
    sides: Segments = Field(48, description="number of segments round the tube")

    @property
    def triangle_count(self) -> int:
        return 2 * self.segments * self.sides


class Cylinder(Shape):
    """A cylinder of radius 1 with caps, from y = -1 to y = 1."""

    type: Literal["cylinder"] = "cylinder"
    segments: Segments = Field(64, description="number of segments round the y axis")

    @property
    def triangle_count(self) -> int:
        return 4 * self.segments


class Cone(Shape):
    """A cone with a cap of radius 1 at y = -1 and its tip at y = 1."""

    type: Literal["cone"] = "cone"
    segments: Segments = Field(64, description="number of segments round the y axis")

    @property
    def triangle_count(self) -> int:
        return 2 * self.segments


SHAPES: dict[str, type[Document]] = {
    model.__name__.lower(): model for model in (Sphere, Icosphere, Cube, Plane, Torus, Cylinder, Cone)
}
