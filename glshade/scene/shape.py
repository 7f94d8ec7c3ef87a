"""Shape: a primitive as a scene names it. The meshes themselves are made in primitives.py."""

from functools import lru_cache
from typing import Annotated, Literal

from pydantic import Field

from glshade.document import Document
from glshade.mesh import primitives
from glshade.mesh.mesh import Mesh

Segments = Annotated[int, Field(ge=3, le=4096)]


class Shape(Document):
    """A primitive of unit size about the origin."""

    type: str

    def mesh(self) -> Mesh:
        """Its mesh; the same object for equal shapes."""
        return _mesh(self)


@lru_cache(maxsize=256)
def _mesh(shape: Shape) -> Mesh:
    return primitives.PRIMITIVES[shape.type](**shape.model_dump(exclude={"type"}))


class Sphere(Shape):
    """Radius 1, with poles on the y axis and texture coordinates."""

    type: Literal["sphere"] = "sphere"
    segments: Segments = Field(96, description="round the y axis")
    rings: Annotated[int, Field(ge=2, le=4096)] = Field(48, description="from pole to pole")


class Icosphere(Shape):
    """Radius 1, of triangles of almost one size."""

    type: Literal["icosphere"] = "icosphere"
    subdivisions: Annotated[int, Field(ge=0, le=9)] = Field(4, description="20 x 4^n triangles")


class Cube(Shape):
    """From -1 to 1 along each axis."""

    type: Literal["cube"] = "cube"


class Plane(Shape):
    """y = 0, facing up, from -1 to 1."""

    type: Literal["plane"] = "plane"
    segments: Annotated[int, Field(ge=1, le=4096)] = Field(1, description="along each side")


class Torus(Shape):
    """Round the y axis; the tube's middle is a circle of radius 1."""

    type: Literal["torus"] = "torus"
    minor: Annotated[float, Field(gt=0, lt=1)] = Field(0.4, description="radius of the tube")
    segments: Segments = Field(96, description="round the y axis")
    sides: Segments = Field(48, description="round the tube")


class Cylinder(Shape):
    """Radius 1, from y = -1 to 1, with caps."""

    type: Literal["cylinder"] = "cylinder"
    segments: Segments = Field(64, description="round the y axis")


class Cone(Shape):
    """Radius 1 at y = -1, tip at y = 1, with a cap."""

    type: Literal["cone"] = "cone"
    segments: Segments = Field(64, description="round the y axis")


SHAPES: dict[str, type[Document]] = {
    model.__name__.lower(): model for model in (Sphere, Icosphere, Cube, Plane, Torus, Cylinder, Cone)
}
