"""DAE: COLLADA 1.4 and 1.5, a scene in XML (Khronos). File space has y up and is in metres, as COLLADA's asset says.

pycollada, on which trimesh relies, is not used: it has no strips and fans, and it cuts every polygon as a convex one.
"""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

import numpy as np

from glshade.arrays import Float64
from glshade.errors import printable
from glshade.limits import MOST_INSTANCES
from glshade.mesh.mesh import Mesh
from glshade.mesh.reading.collada_material import Materials
from glshade.mesh.reading.collada_shape import Primitive, Shape
from glshade.mesh.reading.colours import display_colours
from glshade.mesh.reading.contents import Material
from glshade.mesh.reading.file import MeshFile, short
from glshade.mesh.reading.markup import tree, words

# The axes that point right, up and towards the viewer (COLLADA 1.4.1, "up_axis") -> the turn to y up.
_AXES = {
    "X_UP": [[0, -1, 0], [1, 0, 0], [0, 0, 1]],
    "Y_UP": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "Z_UP": [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
}
# The chain of nodes that contain each other as instances.
_DEEPEST = 64


def read(file: MeshFile) -> None:
    """Adds a part for each primitive of each geometry that the scene of a COLLADA file places. Errors: AssetError."""
    root = tree(file, file.data)
    if root.tag != "COLLADA":
        raise file.fail(f"is not a readable DAE file: its XML begins with <{printable(short(root.tag))}>, not <COLLADA>")
    _Scene(file, root).add()


class _Scene:
    """Adds the geometries of a document to the contents of a file, each once."""

    def __init__(self, file: MeshFile, root: Element) -> None:
        self._file, self._root = file, root
        self._ids = {e.get("id", ""): e for e in root.iter() if "id" in e.attrib}
        self._materials = Materials(file, self._ids)
        self._shapes: dict[int, Shape] = {}
        # Geometry and the set of uvs of each of its primitives -> the mesh, or its index in the contents, of each primitive.
        self._built: dict[tuple[int, tuple[int | None, ...]], list[Mesh | int | None]] = {}
        self._not_read: dict[str, int] = {}

    def add(self) -> None:
        """Adds all parts. Errors: AssetError."""
        root = self._world()
        reference = self._root.find("scene/instance_visual_scene")
        scene = self._target(reference) if reference is not None else self._root.find("library_visual_scenes/visual_scene")
        if scene is None:
            geometries = self._root.findall("library_geometries/geometry")
            if geometries:
                self._file.warn("has no scene; drawn with all its geometries")
            for geometry in geometries:
                self._add_geometry(_name(geometry), geometry, None, root)
        else:
            for node, transform in self._nodes(scene, root):
                self._add_node(node, transform, root)
        if self._not_read:
            counted = ", ".join(f"{count:,} {name}" for name, count in self._not_read.items())
            self._file.warn(f"{counted} not read; drawn without them")

    def _world(self) -> Float64:
        """Returns the transform (4, 4) from the scene to file space: the axis that is up, and the unit."""
        axis = (self._root.findtext("asset/up_axis") or "Y_UP").strip().upper()
        unit = self._root.find("asset/unit")
        try:
            (metres,) = words(unit.get("meter", "1")) if unit is not None else (1.0,)
        except ValueError:
            metres = float("nan")
        if not 0 < metres < float("inf"):
            self._file.warn("its unit is not a number of metres; drawn as if it were 1 metre")
            metres = 1.0
        result = np.eye(4)
        result[:3, :3] = metres * np.array(_AXES.get(axis, _AXES["Y_UP"]), dtype=np.float64)
        return result

    def _target(self, element: Element) -> Element | None:
        """Returns the element that an attribute `url` names; None, with a warning, where the file has none."""
        url = element.get("url", "")
        found = self._ids.get(url.removeprefix("#")) if url.startswith("#") else None
        if found is None:
            self._file.warn(f"<{element.tag}> names '{printable(short(url))}', which the file does not hold; drawn without it")
        return found

    def _nodes(self, scene: Element, root: Float64) -> Iterator[tuple[Element, Float64]]:
        """Yields the nodes of a scene, depth first, with the transform (4, 4) of each to file space. Errors: AssetError."""
        allowed = MOST_INSTANCES + sum(1 for _ in self._root.iter("node"))
        visited = 0
        waiting: list[tuple[Element, Float64, tuple[Element, ...]]] = [(scene, root, ())]
        while waiting:
            node, parent, above = waiting.pop()
            visited += 1
            if visited > allowed:
                raise self._file.fail(f"instances of nodes make more than {MOST_INSTANCES:,} nodes")
            with np.errstate(all="ignore"):
                transform = parent @ self._transform(node)
            if not np.isfinite(transform).all():
                raise self._file.fail(f"node '{_name(node)}' has a transform that is not finite")
            yield node, transform
            inside: list[tuple[Element, Float64, tuple[Element, ...]]] = []
            for child in node:
                if child.tag == "node":
                    inside.append((child, transform, above))
                elif child.tag == "instance_node" and (target := self._target(child)) is not None:
                    if target in above or len(above) > _DEEPEST:
                        raise self._file.fail(f"node '{_name(target)}' contains itself, or instances are nested too deep")
                    inside.append((target, transform, (*above, target)))
            waiting += reversed(inside)

    def _transform(self, node: Element) -> Float64:
        """Returns the transform (4, 4) of a node, the product of its elements in their order. Errors: AssetError."""
        result = np.eye(4)
        for element in node:
            size = {"matrix": 16, "translate": 3, "rotate": 4, "scale": 3, "lookat": 9}.get(element.tag)
            if size is None:
                if element.tag == "skew":
                    self._not_read["skews"] = self._not_read.get("skews", 0) + 1
                continue
            try:
                values = np.array(words(element.text or ""))
            except ValueError:
                values = np.empty(0)
            if len(values) != size:
                raise self._file.fail(f"node '{_name(node)}': <{element.tag}> does not have {size} numbers")
            with np.errstate(all="ignore"):
                result = result @ _matrix(element.tag, values)
        return result

    def _add_node(self, node: Element, transform: Float64, root: Float64) -> None:
        """Adds what a node holds. root: the transform from the scene to file space. Errors: AssetError."""
        for child in node:
            if child.tag in ("instance_light", "instance_camera"):
                name = child.tag.removeprefix("instance_") + "s"
                self._not_read[name] = self._not_read.get(name, 0) + 1
            elif child.tag == "instance_geometry" and (geometry := self._target(child)) is not None:
                self._add_geometry(_name(node), geometry, child, transform)
            elif child.tag == "instance_controller" and (controller := self._target(child)) is not None:
                self._add_controller(_name(node), controller, child, transform, root)

    def _add_controller(self, name: str, controller: Element, instance: Element, transform: Float64, root: Float64) -> None:
        """Adds the geometry under skins and morphs. A skin places it by its joints and not by its node. Errors: AssetError."""
        for _ in range(_DEEPEST):
            skin, morph = controller.find("skin"), controller.find("morph")
            inner = skin if skin is not None else morph
            target = None if inner is None else self._ids.get(inner.get("source", "").removeprefix("#"))
            if inner is None or target is None:
                self._file.warn(f"the controller of node '{name}' has no geometry; drawn without it")
                return
            what = (
                "a skin is drawn in the pose in which it was bound" if inner is skin else "a morph is drawn without its targets"
            )
            self._file.warn(what)
            if inner is skin:
                shape = Element("node")
                bind = inner.find("bind_shape_matrix")
                if bind is not None:
                    shape.append(Element("matrix"))
                    shape[0].text = bind.text
                transform = root @ self._transform(shape)
            if target.tag == "geometry":
                self._add_geometry(name, target, instance, transform)
                return
            controller = target
        raise self._file.fail(f"the controllers of node '{name}' are nested too deep")

    def _add_geometry(self, name: str, geometry: Element, instance: Element | None, transform: Float64) -> None:
        """Adds the primitives of a geometry. instance: the element that binds its materials. Errors: AssetError."""
        key = id(geometry)
        if key not in self._shapes:
            kinds = [e.tag for e in geometry if e.tag in ("convex_mesh", "spline", "brep")]
            if kinds:
                self._file.warn(f"geometry '{_name(geometry)}' is a <{kinds[0]}>, which is not read; drawn without it")
            self._shapes[key] = Shape(self._file, geometry)
        shape = self._shapes[key]
        bound = [self._bound(primitive, instance) for primitive in shape.primitives]
        sets = tuple(uv_set for _, uv_set in bound)
        if (key, sets) not in self._built:
            self._built[key, sets] = self._meshes(_name(geometry), shape, sets)
        contents, meshes = self._file.contents, self._built[key, sets]
        for index, (primitive, (material, _)) in enumerate(zip(shape.primitives, bound, strict=True)):
            mesh = meshes[index]
            if mesh is None:
                continue
            title = name or _name(geometry) or self._file.path.stem
            contents.add(title if primitive.size == 3 else f"{title}.lines", mesh, material, transform)
            meshes[index] = contents.parts[-1]["mesh"]

    def _bound(self, primitive: Primitive, instance: Element | None) -> tuple[Material | None, int | None]:
        """Returns the material of a primitive and the set of texture coordinates that it reads; None for none."""
        bindings = () if instance is None else instance.iter("instance_material")
        found = next((e for e in bindings if primitive.material is not None and e.get("symbol") == primitive.material), None)
        target = found.get("target", "") if found is not None else ""
        if not target:
            # A few programs bind nothing and write the id of the material in place of a symbol.
            known = self._ids.get(primitive.material or "")
            if known is None or known.tag != "material":
                return None, None
            target = f"#{primitive.material}"
        material, texcoord = self._materials.material(target)
        uv_set = None
        for binding in () if found is None else found.findall("bind_vertex_input"):
            if binding.get("semantic") == texcoord and binding.get("input_set", "0").strip().isdecimal():
                uv_set = int(binding.get("input_set", "0"))
        return material, uv_set

    def _meshes(self, name: str, shape: Shape, sets: tuple[int | None, ...]) -> list[Mesh | int | None]:
        """Returns the mesh of each primitive of a geometry; None for one of which nothing is left. Errors: AssetError."""
        where = f"geometry '{name}': "
        arrays = []
        for primitive, uv_set in zip(shape.primitives, sets, strict=True):
            given = dict(shape.arrays(primitive, uv_set))
            if given["colours"] is not None:
                # As in OBJ files, colours of vertices are what programs show, so that they are sRGB-encoded.
                given["colours"] = display_colours(np.clip(np.asarray(given["colours"], dtype=np.float64), 0, 1))
            arrays.append(given)
        surfaces = [k for k, primitive in enumerate(shape.primitives) if primitive.size == 3]
        result: list[Mesh | int | None] = [None] * len(arrays)
        parts = [{("triangles" if key == "simplices" else key): value for key, value in arrays[k].items()} for k in surfaces]
        for k, mesh in zip(surfaces, self._file.build_surface(where, parts) if parts else (), strict=True):
            result[k] = mesh
        for k, primitive in enumerate(shape.primitives):
            if primitive.size == 2:
                named = {key: value for key, value in arrays[k].items() if key not in ("positions", "simplices")}
                result[k] = self._file.build_lines(where, arrays[k]["positions"], arrays[k]["simplices"], **named)
        return result


def _name(element: Element) -> str:
    """Returns the name of an element, or its id."""
    return printable(short(element.get("name") or element.get("id") or ""))


def _matrix(kind: str, values: Float64) -> Float64:
    """Returns the matrix (4, 4) of an element that transforms a node, such as "rotate"."""
    result = np.eye(4)
    if kind == "matrix":
        return values.reshape(4, 4)
    if kind == "translate":
        result[:3, 3] = values
    elif kind == "scale":
        result[[0, 1, 2], [0, 1, 2]] = values
    elif kind == "rotate":
        length = np.linalg.norm(values[:3])
        x, y, z = values[:3] / length if length > 0 else values[:3]
        angle = np.radians(values[3]) if length > 0 else 0.0
        crossed = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        result[:3, :3] += np.sin(angle) * crossed + (1 - np.cos(angle)) * crossed @ crossed  # Rodrigues 1840
    else:  # lookat: the node's -z points from the eye to the target
        eye, target, up = values.reshape(3, 3)
        back = eye - target
        right = np.cross(up, back)
        axes = np.column_stack([right, np.cross(back, right), back])
        result[:3, :3] = axes / np.linalg.norm(axes, axis=0)
        result[:3, 3] = eye
    return result
