"""3MF models: what one part "model" of a 3MF package says, read element by element (3MF Core Specification 1.3).

Of the extensions, the names of materials and textures (Materials and Properties Extension 1.2) and the paths to models in other
parts of the package (Production Extension 1.1) are read.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from glshade.arrays import Float64, Int64
from glshade.mesh.reading.colours import display_colours
from glshade.mesh.reading.file import MeshFile
from glshade.mesh.reading.markup import parse

# The names of units -> millimetres.
_UNITS = {"micron": 0.001, "millimeter": 1.0, "centimeter": 10.0, "inch": 25.4, "foot": 304.8, "meter": 1000.0}


@dataclass(frozen=True)
class Placement:
    """An object that the build or another object places.

    object: the object's id.
    path: the part of the package that holds the object; empty for the part with the placement.
    transform: (4, 4), to the space of the object or build that places it.
    """

    object: int
    path: str
    transform: Float64


@dataclass
class Object:
    """An object of a model: a mesh, or a list of other objects.

    name: its name; empty where it has none.
    group: the id of the group of properties for triangles that name none; -1 for none.
    index: the index in that group.
    vertices: x, y and z of all vertices, one vertex after another.
    triangles: for each triangle its three vertices, then its group and three indices in the group; -1 stands for none.
    components: the other objects of which this consists.
    """

    name: str
    group: int
    index: int
    vertices: array[float] = field(default_factory=lambda: array("d"))
    triangles: array[int] = field(default_factory=lambda: array("q"))
    components: list[Placement] = field(default_factory=list)

    def arrays(self) -> tuple[Float64, Int64, Int64]:
        """Returns the vertices (V, 3), the triangles (T, 3), and the group and three indices of each triangle (T, 4).

        The properties of the object stand where a triangle has none.
        """
        rows = np.array(self.triangles, dtype=np.int64).reshape(-1, 7)
        properties = rows[:, 3:]
        none = properties[:, 1] < 0
        properties[none] = [self.group, self.index, self.index, self.index]
        properties[properties[:, 0] < 0, 0] = self.group
        for corner in (2, 3):
            missing = properties[:, corner] < 0
            properties[missing, corner] = properties[missing, 1]
        return np.array(self.vertices).reshape(-1, 3), rows[:, :3], properties


@dataclass
class Group:
    """A group of properties.

    kind: the name of its element.
    values: the numbers of all its entries: red, green, blue and alpha of colours, u and v of texture coordinates.
    texture: the id of the texture of texture coordinates.
    """

    kind: str
    values: array[float] = field(default_factory=lambda: array("d"))
    texture: int = -1

    @property
    def colours(self) -> Float64:
        """The colours (N, 4), linear. The specification encodes them as sRGB."""
        return display_colours(np.array(self.values).reshape(-1, 4))

    @property
    def uvs(self) -> Float64:
        """The texture coordinates (N, 2), of which v = 0 is the bottom of the picture."""
        return np.array(self.values).reshape(-1, 2)


@dataclass
class Texture:
    """A texture: the path of its picture in the package, and how it continues beyond its edges in u and v."""

    path: str
    wrap: list[str]


@dataclass
class Model:
    """What one part "model" of a package says.

    scale: the size of its unit [mm].
    objects: id -> object.
    groups: id -> group of properties.
    textures: id -> texture.
    build: what is printed.
    """

    scale: float = 1.0
    objects: dict[int, Object] = field(default_factory=dict)
    groups: dict[int, Group] = field(default_factory=dict)
    textures: dict[int, Texture] = field(default_factory=dict)
    build: list[Placement] = field(default_factory=list)


# The groups whose entries are read; of other groups only the names are kept, for a warning.
COLOURS, UVS = ("basematerials", "colorgroup"), "texture2dgroup"
_OTHERS = ("compositematerials", "multiproperties")
_WRAP = {"wrap": "repeat", "mirror": "mirror", "clamp": "clamp", "none": "clamp"}


def model(file: MeshFile, path: str, chunks: Iterable[bytes]) -> Model:
    """Returns the model in a part of a package. path: the name of the part. Errors: AssetError, with part and line."""
    reader = _Reader()
    parse(file, f"{path}, ", chunks, reader.start)
    return reader.model


class _Reader:
    """Collects a model from the elements of its XML. The functions raise KeyError and ValueError for a wrong attribute."""

    def __init__(self) -> None:
        self.model = Model()
        self._object = Object("", -1, -1)
        self._group = Group("")

    def start(self, name: str, given: dict[str, str]) -> None:
        """Takes an element that begins."""
        if name == "vertex":
            self._object.vertices.extend((float(given["x"]), float(given["y"]), float(given["z"])))
        elif name == "triangle":
            read = given.get
            self._object.triangles.extend((int(given["v1"]), int(given["v2"]), int(given["v3"])))
            self._object.triangles.extend((int(read("pid", -1)), int(read("p1", -1)), int(read("p2", -1)), int(read("p3", -1))))
        elif name == "object":
            self._object = Object(given.get("name", ""), int(given.get("pid", -1)), int(given.get("pindex", 0)))
            self.model.objects[int(given["id"])] = self._object
        elif name in ("component", "item"):
            target = self._object.components if name == "component" else self.model.build
            path = next((value for key, value in given.items() if key.rpartition(":")[2] == "path"), "")
            target.append(Placement(int(given["objectid"]), path, _transform(given.get("transform"))))
        elif name in (*COLOURS, UVS, *_OTHERS):
            self._group = Group(name, texture=int(given["texid"]) if name == UVS else -1)
            self.model.groups[int(given["id"])] = self._group
        elif name in ("base", "color"):
            self._group.values.extend(_colour(given["displaycolor" if name == "base" else "color"]))
        elif name == "tex2coord":
            self._group.values.extend((float(given["u"]), float(given["v"])))
        elif name == "texture2d":
            wrap = [_WRAP.get(given.get(key, "wrap"), "repeat") for key in ("tilestyleu", "tilestylev")]
            self.model.textures[int(given["id"])] = Texture(given["path"], wrap)
        elif name == "model":
            self.model.scale = _UNITS[given.get("unit", "millimeter").lower()]


def _transform(text: str | None) -> Float64:
    """Returns a transform (4, 4) for columns. The file has its 4 rows of 3 numbers for row vectors. Errors: ValueError."""
    result = np.eye(4)
    if text is not None:
        result[:3] = np.array([float(word) for word in text.split()]).reshape(4, 3).T
        if not np.isfinite(result).all():
            raise ValueError(text)
    return result


def _colour(text: str) -> tuple[float, ...]:
    """Returns red, green, blue and alpha of "#RRGGBB" or "#RRGGBBAA". Errors: ValueError."""
    digits = text.strip().removeprefix("#")
    if len(digits) not in (6, 8):
        raise ValueError(text)
    return tuple(byte / 255 for byte in bytes.fromhex(f"{digits}FF"[:8]))
