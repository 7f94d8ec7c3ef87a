"""glTF: the JSON form of glTF 2, with its buffers in other files or in data URIs. The nodes of its scene become parts."""

from __future__ import annotations

from typing import Any

import numpy as np

from glshade.arrays import Float64
from glshade.limits import MOST_INSTANCES
from glshade.mesh.mesh import Mesh
from glshade.mesh.reading import gltf_geometry, gltf_material
from glshade.mesh.reading.colours import with_alpha
from glshade.mesh.reading.contents import Material
from glshade.mesh.reading.file import MeshFile, short
from glshade.mesh.reading.gltf_accessors import Accessors
from glshade.mesh.reading.gltf_container import MESHOPT, opened
from glshade.mesh.reading.gltf_geometry import LINE_LOOP, LINES, POINTS, TRIANGLES, Geometry
from glshade.mesh.reading.gltf_nodes import Nodes, instances, is_flat
from glshade.mesh.reading.gltf_scene import add_camera, add_light
from glshade.mesh.strokes import segments

# The extensions that this reader follows, in addition to those of materials.
FOLLOWED = {
    "EXT_mesh_gpu_instancing",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    *MESHOPT,
}
# Extensions that do not change the picture of a file's default state, or only annotate it.
HARMLESS = {
    "EXT_mesh_features",
    "EXT_structural_metadata",
    "KHR_animation_pointer",
    "KHR_materials_variants",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "KHR_xmp",
    "KHR_xmp_json_ld",
}
# The starts of the names of extensions of materials, about which glshade.mesh.reading.gltf_material warns.
OF_MATERIALS = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "MSFT_texture_")


def read(file: MeshFile) -> None:
    """Adds a part for each primitive of each node of a glTF scene, and its cameras and lights. Nodes with one mesh share it.

    Errors: AssetError.
    """
    header, buffers = opened(file)
    _check_extensions(file, header)
    reader = _Reader(file, header, buffers)
    nodes = Nodes(file, header)
    lights = header.get("extensions", {}).get("KHR_lights_punctual", {}).get("lights", [])
    for index in nodes.drawn():
        node, world = nodes.tables[index], nodes.world[index]
        if "mesh" in node:
            reader.add(nodes, index)
        if "camera" in node:
            add_camera(file, node["camera"], header["cameras"][node["camera"]], node, world)
        light = node.get("extensions", {}).get("KHR_lights_punctual", {}).get("light")
        if light is not None:
            if light >= len(lights):
                raise file.fail(f"nodes[{index}]: light {light} does not exist; the file has {len(lights)} lights")
            add_light(file, light, lights[light], world)
    if not nodes.tables:
        reader.add_loose()
    if header.get("animations"):
        file.warn("its animations are not played; drawn as its nodes stand without them")
    if not file.contents.parts:
        raise file.fail("holds nothing to draw: no visible node of its scene has a mesh with triangles, lines or points")


def _check_extensions(file: MeshFile, header: dict[str, Any]) -> None:
    """Refuses a file that needs an extension which is not followed, and warns of one that is only used. Errors: AssetError."""
    known = FOLLOWED | HARMLESS | gltf_material.EXTENSIONS
    needed = sorted(set(header.get("extensionsRequired", ())) - known)
    if needed:
        names = ", ".join(map(short, needed))
        raise file.fail(f"needs the glTF extension {names}, which glshade does not read; save the file without it")
    unused = sorted(name for name in set(header.get("extensionsUsed", ())) - known if not name.startswith(OF_MATERIALS))
    if unused:
        file.warn(f"the glTF extensions {', '.join(map(short, unused))} are not used; drawn without them")


class _Reader:
    """Builds the meshes of a file, each once for all nodes that show it in the same way."""

    def __init__(self, file: MeshFile, header: dict[str, Any], buffers: list[bytes]) -> None:
        """header: the JSON of the file, whose shape is checked. buffers: the bytes of its buffers.

        Errors: AssetError for more triangles than the file stores and the limits allow.
        """
        self.file, self.header, self.buffers = file, header, buffers
        self.accessors = Accessors(file, header, buffers)
        self.meshes: list[dict[str, Any]] = header.get("meshes", [])
        # Primitives may share accessors, so that all of them are counted before the first is read.
        sizes = [gltf_geometry.size(self.accessors, primitive) for mesh in self.meshes for primitive in mesh["primitives"]]
        self.accessors.spend(sum(corners for corners, _ in sizes), sum(values for _, values in sizes))
        # Number of a mesh -> the primitives of which it consists.
        self._geometry: dict[int, list[tuple[str, Geometry, Material]]] = {}
        # Number of a material (-1: the default) -> its table.
        self._materials: dict[int, Material] = {}
        # What decides how a mesh looks -> its parts, each an index in the contents and a material.
        self._built: dict[tuple[Any, ...], list[tuple[int | Mesh, Material]]] = {}

    def add(self, nodes: Nodes, index: int) -> None:
        """Adds the parts of a node with a mesh. Errors: AssetError."""
        node = nodes.tables[index]
        number, world = node["mesh"], nodes.world[index]
        weights = tuple(node.get("weights", self.meshes[number].get("weights", ())))
        skin = node.get("skin")
        mirrored = float(np.linalg.det(world[:3, :3])) < 0
        if skin is not None and self._is_skinned(number):
            # The transform of a skinned mesh's node does not move it (glTF 2.0, 3.7.3.3), but still gives the winding (3.7.4).
            self._place(node, number, (number, weights, skin, mirrored), np.eye(4), nodes)
            return
        copies = instances(self.accessors, node)
        for transform in [world] if copies is None else world @ copies:
            # A node whose scale is 0 along all axes is invisible (glTF 2.0, 3.5.3).
            if transform[:3, :3].any():
                key = (number, weights, transform.tobytes()) if is_flat(transform) else (number, weights)
                self._place(node, number, key, transform, nodes)

    def add_loose(self) -> None:
        """Adds the meshes of a file without nodes. Errors: AssetError."""
        for number, mesh in enumerate(self.meshes):
            self._place({}, number, (number, tuple(mesh.get("weights", ()))), np.eye(4), None)

    def _is_skinned(self, number: int) -> bool:
        """Returns whether a primitive of a mesh names joints."""
        return any(shape.joints is not None for _, shape, _ in self._shapes(number))

    def _place(self, node: dict[str, Any], number: int, key: tuple[Any, ...], transform: Float64, nodes: Nodes | None) -> None:
        """Adds the parts of a mesh at one place.

        node: the JSON of the node.
        number: the number of the mesh.
        key: what decides how the mesh looks: its number, its morph weights, and optionally its skin and whether its node
            mirrors, or the bytes of a transform that flattens it.
        transform: (4, 4) to file space.

        Errors: AssetError.
        """
        if key not in self._built:
            self._built[key] = [
                (mesh, material)
                for where, shape, material in self._shapes(number)
                if (mesh := self._mesh(where, shape, key, transform, nodes)) is not None
            ]
        parts = self._built[key]
        if len(key) == 3:
            transform = np.eye(4)
        if len(self.file.contents.parts) + len(parts) > MOST_INSTANCES:
            raise self.file.fail(
                f"its nodes draw more than {MOST_INSTANCES:,} parts, which is the most that a picture may have"
            )
        title = node.get("name") or self.meshes[number].get("name") or f"mesh {number}"
        for place, (known, material) in enumerate(parts):
            name = f"{title}.{place + 1}" if len(parts) > 1 else title
            self.file.contents.add(name, known, material, transform)
            if isinstance(known, Mesh):
                parts[place] = len(self.file.contents.meshes) - 1, material

    def _shapes(self, number: int) -> list[tuple[str, Geometry, Material]]:
        """Returns the primitives of a mesh, each with its place in the file and its material. Errors: AssetError."""
        if number not in self._geometry:
            found = []
            for index, primitive in enumerate(self.meshes[number]["primitives"]):
                where = f"meshes[{number}].primitives[{index}]"
                uv_set = gltf_material.uv_set(self.header, primitive)
                shape = gltf_geometry.geometry(self.accessors, primitive, uv_set, where)
                if shape is not None:
                    found.append((where, shape, self._material(primitive.get("material", -1))))
            self._geometry[number] = found
        return self._geometry[number]

    def _material(self, number: int) -> Material:
        """Returns the table of a material; -1 stands for the default of glTF (glTF 2.0, 3.9.6). Errors: AssetError."""
        if number not in self._materials:
            given = {} if number < 0 else self.header["materials"][number]
            place = "the default material" if number < 0 else f"materials[{number}]"
            self._materials[number] = gltf_material.material(self.file, self.header, self.buffers, given, place)
        return self._materials[number]

    def _mesh(self, where: str, shape: Geometry, key: tuple[Any, ...], transform: Float64, nodes: Nodes | None) -> Mesh | None:
        """Returns the mesh of a primitive as `_place` shows it; None where nothing is left to draw. Errors: AssetError."""
        values = sum(map(len, shape.attributes.values()))
        if len(self._built) >= len(self.meshes):
            # A mesh that is posed in many ways makes more than the file stores.
            self.accessors.spend(len(shape.order), values)
        if shape.targets:
            shape = gltf_geometry.morphed(shape, list(key[1]))
        mirrored = False
        if len(key) == 4 and nodes is not None:
            shape, mirrored = gltf_geometry.skinned(self.file, shape, self._joints(key[2], nodes), where), key[3]
        elif len(key) == 3:
            shape, mirrored = gltf_geometry.transformed(shape, transform), False
        return _built(self.file, where, shape, mirrored)

    def _joints(self, number: int, nodes: Nodes) -> Float64:
        """Returns the transforms (J, 4, 4) of the joints of a skin from the mesh's space to file space. Errors: AssetError."""
        skin = self.header["skins"][number]
        world: Float64 = nodes.world[skin["joints"]]
        if "inverseBindMatrices" not in skin:
            return world
        index = skin["inverseBindMatrices"]
        if self.accessors.count(index) < len(world):
            raise self.file.fail(f"skins[{number}] has {len(world)} joints, but {self.accessors.count(index)} matrices")
        self.accessors.spend(0, 4 * self.accessors.count(index))
        matrices = self.accessors.floats(index, (16,))[: len(world)]
        joints: Float64 = world @ matrices.reshape(-1, 4, 4).transpose(0, 2, 1)
        if not np.isfinite(joints).all():
            raise self.file.fail(f"skins[{number}].inverseBindMatrices hold numbers that are not finite")
        return joints


def _built(file: MeshFile, where: str, shape: Geometry, mirrored: bool) -> Mesh | None:
    """Returns the mesh of a posed primitive; None where its topology gives nothing to draw.

    mirrored: whether its triangles are wound clockwise, as seen from outside.

    Errors: AssetError.
    """
    given = shape.attributes
    uvs, colours, normals = given.get("TEXCOORD"), given.get("COLOR"), given.get("NORMAL")
    if uvs is not None:
        uvs = np.column_stack([uvs[:, 0], 1 - uvs[:, 1]])  # in glTF v = 0 is the top of the picture
    if colours is not None:
        colours = with_alpha(colours)  # they are linear (glTF 2.0, 3.7.2.1)
    optional = {"normals": normals, "uvs": uvs, "colours": colours}
    if shape.mode == POINTS:
        return file.build_points(f"{where}: ", given["POSITION"], shape.order, **optional) if len(shape.order) else None
    if shape.mode < TRIANGLES:
        kind: Any = "lines" if shape.mode == LINES else "loop" if shape.mode == LINE_LOOP else "strip"
        lines = segments(shape.order, kind)
        return file.build_lines(f"{where}: ", given["POSITION"], lines, **optional) if len(lines) else None
    triangles = gltf_geometry.triangles(shape)
    if not len(triangles):
        return None
    if mirrored:
        triangles = triangles[:, ::-1]
    # Without normals every face is flat, and tangents do not count (glTF 2.0, 3.7.2.1).
    further: dict[str, Any] = {}
    if normals is None:
        further["smoothing"] = np.zeros(len(triangles), dtype=np.int64)
    elif "TANGENT" in given:
        further["tangents"] = given["TANGENT"]
    return file.build(f"{where}: ", given["POSITION"], triangles, **optional, **further)
