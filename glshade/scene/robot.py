"""Robot: turns a URDF file into the document of a scene, with an object for each link at the values of the joints.

URDF is the Unified Robot Description Format of ROS (https://wiki.ros.org/urdf/XML). The library yourdfpy, of the extra
`robots`, reads its elements. Robots stand on the plane of x and y with z up, and are turned so that y is up.
"""

from __future__ import annotations

import io
import math
import re
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np
from numpy.typing import NDArray

from glshade.document import nearest
from glshade.errors import AssetError, AssetWarning, MissingLibrary, SceneError, figure, printable
from glshade.files import read_bytes
from glshade.image.srgb import srgb_to_linear
from glshade.limits import LARGEST_SCENE, SMALLEST_NUMBER, Limits
from glshade.mesh import file as mesh_file
from glshade.mesh.reading import markup
from glshade.mesh.reading.file import MeshFile, is_file

Array = NDArray[np.float64]

# The turn from z up to y up, and its inverse.
Y_FROM_Z = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
Z_FROM_Y = Y_FROM_Z.T
# The formats that define which axis is up. Their readers turn it to y, and in a robot z is up. The numbers of other formats are
# those of the link, as ROS takes them.
WITH_UP = frozenset({".dae", ".3mf", ".gltf", ".glb"})
# The elements that decide what a robot looks like, each with those in it. All others, such as masses and collisions, are left
# out before the file is read, so that faults in them do no harm.
DRAWN: Mapping[str, Any] = {
    "link": {"visual": {"origin": {}, "geometry": {"box": {}, "cylinder": {}, "sphere": {}, "mesh": {}}, "material": {}}},
    "joint": {"origin": {}, "parent": {}, "child": {}, "axis": {}, "limit": {}, "mimic": {}},
    "material": {},
}
MATERIAL: Mapping[str, Any] = {"color": {}, "texture": {}}
COMMENT = re.compile(rb"<!--.*?-->", re.DOTALL)
MOVING = ("revolute", "continuous", "prismatic")
KINDS = (*MOVING, "fixed", "floating", "planar")


@dataclass(frozen=True)
class JointState:
    """A joint and its value.

    name: its name.
    kind: "revolute", "continuous", "prismatic", "fixed", "floating" or "planar".
    value: its value [radians, or scene units if prismatic].
    low, high: the limits of the value; infinite where there is none.
    mimics: the name of the joint whose value it follows; None if it has a value of its own.
    """

    name: str
    kind: str
    value: float
    low: float
    high: float
    mimics: str | None


def document(path: Path, values: Mapping[str, float], limits: Limits) -> dict[str, Any]:
    """Returns the objects and the description of a robot's scene, as the table of a scene file.

    path: the URDF file.
    values: name of a joint -> its value [radians, or scene units for a prismatic joint]. Others are at 0, or at the nearest
        value that their limits allow.
    limits: the limits of the scene, which say whether the file may name files outside its folders.
    Errors: SceneError, one line that names the file and the place in it; MissingLibrary without yourdfpy.
    """
    return Robot(path, values, limits).document()


class Robot:
    """A URDF file with values for its joints.

    joints: the joints, in the order of the file.
    """

    def __init__(self, path: Path, values: Mapping[str, float], limits: Limits) -> None:
        """Reads the file. The arguments and errors are those of `document`."""
        self.path, self._limits = path, limits
        self._file = MeshFile(path, path.absolute().parent, _bytes(path), limits=limits)
        self._file.folders = frozenset({self._package.resolve()})
        self._robot = self._read(_drawn(self._file))
        self._links = {link.name: link for link in self._robot.links}
        self._by_name = {joint.name: joint for joint in self._robot.joints}
        self._check()
        self._values = dict(values)
        for name, value in values.items():
            self._check_value(name, value)
        self.joints = tuple(
            JointState(joint.name, joint.type, self._value(joint), *_range(joint), joint.mimic and joint.mimic.joint)
            for joint in self._robot.joints
        )

    def document(self) -> dict[str, Any]:
        """Returns the table of the scene. Errors: SceneError."""
        placed = self._poses()
        objects: list[dict[str, Any]] = []
        names = set(self._links)
        for link in self._robot.links:
            if not link.visuals:
                continue
            pose = Y_FROM_Z @ placed[link.name]
            objects.append({"name": link.name, "transform": {"matrix": _rows(pose)}})
            for number, visual in enumerate(link.visuals):
                name = f"{link.name}/{visual.name or number}"
                while name in names:
                    name += "'"
                names.add(name)
                objects.append({"name": name, "parent": link.name, **self._visual(visual, self._in("link", link.name))})
        if not objects:
            raise self._fail("", "none of its links has a <visual>, so there is nothing to draw")
        return {"description": f"{self.path.name}: {printable(self._robot.name)}", "objects": objects}

    @cached_property
    def _folders(self) -> frozenset[Path]:
        """The folders of all meshes, in which each of them may name files. They are those of the scene's own loader, so that no
        file is read twice. Errors: SceneError.
        """
        meshes = (
            self._named(visual.geometry.mesh.filename, self._in("link", link.name))
            for link in self._robot.links
            for visual in link.visuals
            if visual.geometry.mesh is not None
        )
        return frozenset(path.parent.resolve() for path in meshes)

    @cached_property
    def _package(self) -> Path:
        """The nearest folder above the file that ROS marks as a package by package.xml; else the folder of the file."""
        above = (self._file.folder, *self._file.folder.parents)
        return next((folder for folder in above if is_file(folder / "package.xml")), self._file.folder)

    def _fail(self, place: str, message: str) -> SceneError:
        return SceneError(f"{self.path}: {place}{message}")

    def _in(self, kind: str, name: str) -> str:
        return f'{kind} "{printable(str(name)[:100])}": '

    def _read(self, root: Element) -> Any:
        """Returns the robot as yourdfpy reads it. Errors: SceneError, which names the link, joint or material at fault."""
        try:
            return _parsed(root)
        except MissingLibrary:
            raise
        except Exception:  # the library raises whatever its steps raise
            for element in root:
                alone = Element("robot", name="")
                alone.append(element)
                try:
                    _parsed(alone)
                except Exception:
                    place = self._in(element.tag, element.get("name", ""))
                    wrong = "lacks an element or an attribute, or has a number that cannot be read"
                    raise self._fail(place, wrong) from None
            raise  # not reached: a robot whose elements can be read can be read

    def _check(self) -> None:
        """Checks that the links form a tree. Errors: SceneError."""
        for kind, items in (("link", self._robot.links), ("joint", self._robot.joints)):
            seen: set[str] = set()
            for item in items:
                if item.name in seen or not item.name:
                    raise self._fail(self._in(kind, item.name), f"two {kind}s have this name" if item.name else "has no name")
                seen.add(item.name)
        if not self._links:
            raise self._fail("", "has no <link>, so there is nothing to draw")
        for joint in self._robot.joints:
            self._check_joint(joint)
        parents = self._parents
        roots = [name for name in self._links if name not in parents]
        if len(roots) > 1:
            shown = ", ".join(printable(name[:100]) for name in roots[:3])
            raise self._fail("", f"has {len(roots)} links that no joint holds ({shown}, ...); a robot has one root")
        self._poses_in_order()

    def _check_joint(self, joint: Any) -> None:
        place = self._in("joint", joint.name)
        if joint.type not in KINDS:
            raise self._fail(place, f"its type must be one of {', '.join(KINDS)}")
        for end, name in (("parent", joint.parent), ("child", joint.child)):
            if name not in self._links:
                raise self._fail(place, f'its {end} "{printable(str(name)[:100])}" is none of the links')
        ratio = joint.mimic and (joint.mimic.multiplier, joint.mimic.offset)
        if not all(map(_is_finite, (joint.origin, joint.axis, ratio))) or any(map(math.isnan, _range(joint))):
            raise self._fail(place, "has a number that is not finite")
        if joint.type in MOVING and not np.linalg.norm(joint.axis) > 0:
            raise self._fail(place, "its axis has no direction")
        low, high = _range(joint)
        if low > high:
            raise self._fail(place, f"its lower limit {figure(low)} lies above its upper limit {figure(high)}")
        followed, seen = joint, {joint.name}
        while followed.mimic is not None:
            if followed.mimic.joint not in self._by_name:
                raise self._fail(place, f'mimics "{printable(str(followed.mimic.joint)[:100])}", which is none of the joints')
            followed = self._by_name[followed.mimic.joint]
            if followed.name in seen:
                raise self._fail(place, "mimics itself through other joints")
            seen.add(followed.name)

    def _check_value(self, name: str, value: float) -> None:
        """Checks that a joint can have a value. Errors: SceneError."""
        place = self._in("joint", name)
        joint = self._by_name.get(name)
        if joint is None:
            movable = [j.name for j in self._robot.joints if j.type in MOVING and j.mimic is None]
            raise self._fail(place, f"there is no such joint{nearest(name, movable)}")
        if joint.mimic is not None:
            raise self._fail(place, f'follows the joint "{printable(joint.mimic.joint)}"; set that one')
        if joint.type not in MOVING:
            raise self._fail(place, f"is {joint.type}; values are for {', '.join(MOVING)} joints")
        low, high = _range(joint)
        if not low <= value <= high:
            raise self._fail(place, f"{figure(value)} lies outside its limits, {figure(low)} to {figure(high)}")

    def _value(self, joint: Any) -> float:
        """Returns the value of a joint. The chain of joints that it mimics has been checked."""
        factor, offset = 1.0, 0.0
        while joint.mimic is not None:
            # value = factor (multiplier v + added) + offset, where v is the value of the joint that is followed.
            offset += factor * joint.mimic.offset
            factor *= joint.mimic.multiplier
            joint = self._by_name[joint.mimic.joint]
        low, high = _range(joint)
        own = self._values.get(joint.name, min(max(0.0, low), high)) if joint.type in MOVING else 0.0
        return float(factor * own + offset)

    @cached_property
    def _parents(self) -> dict[str, Any]:
        """Name of a link -> the joint that holds it. Errors: SceneError."""
        parents: dict[str, Any] = {}
        for joint in self._robot.joints:
            if joint.child in parents:
                both = f'"{printable(parents[joint.child].name[:100])}" and "{printable(joint.name[:100])}"'
                raise self._fail(self._in("link", joint.child), f"two joints hold it: {both}")
            parents[joint.child] = joint
        return parents

    def _poses_in_order(self) -> list[str]:
        """Returns the names of the links, each after its parent. Errors: SceneError where joints form a circle."""
        children: dict[str, list[str]] = {}
        for child, joint in self._parents.items():
            children.setdefault(joint.parent, []).append(child)
        order = [name for name in self._links if name not in self._parents]
        for name in order:  # the list grows while it is read
            order.extend(children.get(name, ()))
        if len(order) < len(self._links):
            lost = next(name for name in self._links if name not in set(order))
            raise self._fail(self._in("link", lost), "its joints form a circle, which has no root")
        return order

    def _poses(self) -> dict[str, Array]:
        """Returns the transform (4, 4) of each link to the space of the robot, by the link's name."""
        values = {joint.name: joint.value for joint in self.joints}
        poses: dict[str, Array] = {}
        for name in self._poses_in_order():
            joint = self._parents.get(name)
            poses[name] = np.eye(4) if joint is None else poses[joint.parent] @ _moved(joint, values[joint.name])
        return poses

    def _visual(self, visual: Any, place: str) -> dict[str, Any]:
        """Returns the keys of an object for a visual: mesh or shape, transform, material. Errors: SceneError."""
        origin = np.eye(4) if visual.origin is None else visual.origin
        shape, sized, textured, own = self._geometry(visual.geometry, place)
        matrix = origin @ sized
        if not _is_finite(matrix):
            raise self._fail(place, "has a number that is not finite")
        material = None if own else self._material(visual.material, textured, place)
        table = {**shape, "transform": {"matrix": _rows(matrix)}}
        return {**table, "material": material} if material else table

    def _geometry(self, geometry: Any, place: str) -> tuple[dict[str, Any], Array, bool, bool]:
        """Returns (key of the shape or mesh, its transform (4, 4) to the visual, whether it has texture coordinates, whether it
        has materials or colours of its own). Errors: SceneError.
        """
        if geometry.mesh is not None:
            return self._mesh(geometry.mesh, place)
        if geometry.box is not None:
            sizes, shape, turn = np.asarray(geometry.box.size) / 2, "cube", np.eye(4)
        elif geometry.sphere is not None:
            # Our spheres and cylinders stand on y, those of URDF on z.
            sizes, shape, turn = np.full(3, geometry.sphere.radius), "sphere", Z_FROM_Y
        else:
            cylinder = geometry.cylinder
            sizes, shape, turn = np.array([cylinder.radius, cylinder.length / 2, cylinder.radius]), "cylinder", Z_FROM_Y
        if sizes.shape != (3,) or not (np.isfinite(sizes).all() and (sizes > 0).all()):
            raise self._fail(place, f"the sizes of its {'box' if shape == 'cube' else shape} must be positive numbers")
        return {"shape": shape}, turn @ np.diag([*sizes, 1.0]), True, False

    def _mesh(self, mesh: Any, place: str) -> tuple[dict[str, Any], Array, bool, bool]:
        """Returns the values of `_geometry` for a mesh file. Errors: SceneError."""
        path = self._named(mesh.filename, place)
        scale = np.ones(3) if mesh.scale is None else np.asarray(mesh.scale, dtype=np.float64)
        if scale.size not in (1, 3) or not (np.isfinite(scale).all() and scale.all()):
            raise self._fail(place, "the scale of its mesh must be one number or three, none of them zero")
        try:
            parts = mesh_file.load(path, self._limits, self._folders).parts
        except AssetError as error:
            raise SceneError([f"{self.path}: {place}{problem}" for problem in error.problems]) from None
        turn = Z_FROM_Y if path.suffix.lower() in WITH_UP else np.eye(4)
        own = any(part.material is not None or part.mesh.colours is not None for part in parts)
        return (
            {"mesh": str(path)},
            np.diag([*np.broadcast_to(scale.reshape(-1), 3), 1.0]) @ turn,
            all(part.mesh.uvs is not None for part in parts),
            own,
        )

    def _material(self, material: Any, textured: bool, place: str) -> dict[str, Any] | None:
        """Returns the material of a visual; None where it has none. textured: whether the shape has texture coordinates."""
        if material is None:
            return None
        if material.color is None and material.texture is None:
            if material.name not in self._materials:
                self._warn(place, f'its material "{printable(str(material.name)[:100])}" is not defined; drawn in grey')
                return None
            material = self._materials[material.name]
        rgba = np.ones(4) if material.color is None else np.asarray(material.color.rgba, dtype=np.float64)
        if rgba.shape != (4,) or not ((rgba >= 0) & (rgba <= 1)).all():
            raise self._fail(place, "the rgba of its material must be four numbers from 0 to 1")
        # Programs of ROS show these numbers as they are, so they are sRGB-encoded.
        kd: Any = srgb_to_linear(rgba[:3]).tolist()
        if material.texture is not None:
            kd = self._texture(material.texture.filename, kd, textured, place)
        blended = {"alpha_mode": "blend", "alpha": float(rgba[3])} if rgba[3] < 1 else {}
        return {"brdf": "lambert", "kd": kd, **blended}

    def _texture(self, name: str, kd: Any, textured: bool, place: str) -> Any:
        """Returns the table of a texture; the plain colour, with a warning, where it cannot be drawn."""
        if not textured:
            self._warn(place, "its mesh has no texture coordinates; drawn without its texture")
            return kd
        try:
            return {"texture": str(self._named(name, place))}
        except SceneError as error:
            warnings.warn(f"{'; '.join(error.problems)}; drawn without it", AssetWarning, stacklevel=2)
            return kd

    @cached_property
    def _materials(self) -> dict[str, Any]:
        """Name -> definition of a material. A visual may define one that others name; the first definition counts."""
        inline = (visual.material for link in self._robot.links for visual in link.visuals if visual.material is not None)
        found: dict[str, Any] = {}
        for material in (*self._robot.materials, *inline):
            if material.name and (material.color is not None or material.texture is not None):
                found.setdefault(material.name, material)
        return found

    def _named(self, name: str | None, place: str) -> Path:
        """Returns the absolute path of a file that the robot names. Errors: SceneError where it is missing or outside."""
        candidates = [path for path in self._candidates((name or "").strip()) if is_file(path)]
        inside = [path for path in candidates if not self._file.is_outside(path)]
        shown = printable((name or "")[:200])
        if inside:
            return inside[0]
        if candidates or self._file.is_outside(self._file.folder / _plain(shown)):
            raise self._fail(
                place, f"'{shown}' lies outside the folder of the file, or of its ROS package (--allow-outside reads it)"
            )
        raise self._fail(place, f"'{shown}' does not exist below {printable(str(self._package))}")

    def _candidates(self, name: str) -> Iterator[Path]:
        """Yields the paths that a name may stand for: a path relative to the file, or package://PACKAGE/PATH."""
        home = self._file.folder
        package, _, rest = _plain(name).partition("/")
        if not name.startswith(("package://", "model://")):
            yield self._file.beside(_plain(name))
            return
        for folder in (home, *home.parents):
            if folder.name == package:
                yield folder / rest
            yield folder / package / rest
        # A package that was copied under another name.
        yield self._package / rest
        yield home / rest

    def _warn(self, place: str, message: str) -> None:
        warnings.warn(f"{self.path}: {place}{message}", AssetWarning, stacklevel=2)


def _bytes(path: Path) -> bytes:
    """Returns the content of a URDF file. Errors: SceneError."""
    try:
        return read_bytes(path, LARGEST_SCENE)
    except FileNotFoundError:
        raise SceneError(f"{path}: there is no such file") from None
    except OSError as error:
        raise SceneError(f"{path}: cannot be read: {error.strerror}") from None


def _drawn(file: MeshFile) -> Element:
    """Returns the element <robot> with the elements that are drawn. Errors: SceneError."""
    root = markup.tree(file, file.data)
    if root.tag != "robot":
        raise file.fail(f"is not URDF: its first element is <{printable(root.tag[:40])}> and not <robot>")
    if b"<xacro:" in COMMENT.sub(b"", file.data):
        raise file.fail(f"is a template of xacro; `xacro {file.path.name} > robot.urdf` turns it into URDF")
    kept = Element("robot", name=root.get("name", "robot"))
    _copy(root, kept, DRAWN)
    return kept


def _copy(source: Element, target: Element, wanted: Mapping[str, Any]) -> None:
    """Copies the wanted elements with their attributes, and not their texts."""
    for element in source:
        if element.tag in wanted:
            inner = MATERIAL if element.tag == "material" else wanted[element.tag]
            # No attribute of URDF has a name beyond ASCII.
            attributes = {name: value for name, value in element.attrib.items() if name.isascii()}
            _copy(element, SubElement(target, element.tag, attributes), inner)


def _parsed(root: Element) -> Any:
    """Returns yourdfpy's Robot. Errors: MissingLibrary, or whatever error the library raises."""
    try:
        from yourdfpy import URDF
    except ImportError:
        raise MissingLibrary('robots need the library yourdfpy: pip install "glshade[robots]"') from None
    return URDF.load(io.BytesIO(tostring(root)), build_scene_graph=False, load_meshes=False).robot


def _range(joint: Any) -> tuple[float, float]:
    """Returns the least and the largest value of a joint. A limit that is left out is 0, as URDF says."""
    if joint.type not in ("revolute", "prismatic") or joint.limit is None:
        return -math.inf, math.inf
    return joint.limit.lower or 0.0, joint.limit.upper or 0.0


def _moved(joint: Any, value: float) -> Array:
    """Returns the transform (4, 4) from a joint's child to its parent."""
    result: Array = np.eye(4) if joint.origin is None else joint.origin.copy()
    if joint.type in MOVING:
        axis = joint.axis / np.linalg.norm(joint.axis)
        motion = np.eye(4)
        if joint.type == "prismatic":
            motion[:3, 3] = value * axis
        else:
            # Rodrigues' formula.
            cross = np.cross(np.eye(3), axis)
            motion[:3, :3] = np.eye(3) + math.sin(value) * cross + (1 - math.cos(value)) * cross @ cross
        result = result @ motion
    return result


def _rows(matrix: Array) -> list[list[float]]:
    """Returns the rows of a transform (4, 4). Numbers that are too small for a scene file become 0."""
    rows: list[list[float]] = np.where(np.abs(matrix) < SMALLEST_NUMBER, 0.0, matrix).tolist()
    return rows


def _is_finite(numbers: Any) -> bool:
    """Returns whether all numbers are finite; true where there are none."""
    return numbers is None or bool(np.isfinite(np.asarray(numbers, dtype=np.float64)).all())


def _plain(name: str) -> str:
    """Returns a name without the beginning package://, model:// or file://."""
    for scheme in ("package://", "model://", "file://"):
        name = name.removeprefix(scheme)
    return name
