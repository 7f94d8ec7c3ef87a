"""Scenes of pyrender, as scenes of glshade."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from glshade.brdfs import BRDFS, Brdf
from glshade.camera import Perspective, is_singular
from glshade.errors import SceneError
from glshade.formats import gltf_material
from glshade.formats.file import File
from glshade.lights import LIGHTS, Light
from glshade.mesh import Mesh
from glshade.mesh_file import AssetWarning
from glshade.pyrender.camera import affine_rows, camera
from glshade.pyrender.textures import picture, rgba
from glshade.scene import Film, Object, Scene, Transform
from glshade.srgb import srgb_to_linear

Array = NDArray[np.float64]

TRIANGLES, STRIP, FAN = 4, 5, 6
MODES = {0: "points", 1: "lines", 2: "lines", 3: "lines"}
# pyrender has no distance below which a light grows no brighter; less than this, nothing is [m].
R_MIN = 1e-9


def from_pyrender(scene: Any, size: tuple[int, int] = (640, 480)) -> Scene:
    """The Scene of a pyrender.Scene, for a picture of `size` (width, height), 4 samples a pixel as there.

    Meshes with their instances, materials, textures, lights, the main camera (without one, the scene is framed) and the
    background. What has no counterpart is left out with an AssetWarning. Errors: SceneError, where nothing is left to draw
    too.
    """
    objects, _ = converted(scene, scene.mesh_nodes)
    if not objects:
        raise SceneError("the scene has no visible triangles")
    background = np.asarray(scene.bg_color, dtype=np.float64)
    # What pyrender clears with is shown as it is.
    shown = [float(c) for c in srgb_to_linear(background[:3])] + [float(background[3])] * bool(background[3] < 1)
    return Scene(
        objects=tuple(objects),
        lights=lights(scene),
        camera=main_camera(scene, size) or Perspective(),
        film=Film(size=size, samples=4, background=tuple(shown)),
    )


def main_camera(scene: Any, size: tuple[int, int]) -> Any:
    """The main camera, None where the scene has none. Errors: SceneError."""
    node = scene.main_camera_node
    return None if node is None else camera(node.camera, scene.get_pose(node), size)


def converted(scene: Any, nodes: Iterable[Any], flat: bool = False, both: bool = False) -> tuple[list[Object], list[Any]]:
    """The objects of the nodes' visible meshes, and the node of each: one for every primitive in every instance.

    flat: base colours as they are, for ambient light of 1. both: back faces are drawn too. In pyrender's order, from far to
    near: of surfaces at one place it is the first that is seen. Errors: SceneError.
    """
    eye = np.zeros(3) if scene.main_camera_node is None else scene.get_pose(scene.main_camera_node)[:3, 3]
    placed = [(node, scene.get_pose(node)) for node in nodes if node.mesh.is_visible]
    placed.sort(key=lambda pair: (-float(np.linalg.norm(pair[1][:3, 3] - eye)), pair[0].name or "", pair[1].tobytes()))
    objects: list[Object] = []
    of: list[Any] = []
    materials: dict[int, Brdf] = {}
    for node, pose in placed:
        for primitive in node.mesh.primitives:
            found = mesh(primitive)
            if found is None:
                continue
            if id(primitive) not in materials:
                materials[id(primitive)] = material(primitive, flat, both)
            instances = [pose] if primitive.poses is None else [pose @ own for own in primitive.poses.astype(np.float64)]
            for matrix in instances:
                # What is flattened covers no pixel.
                if not is_singular(matrix[:3, :3]):
                    transform = Transform.model_validate({"matrix": affine_rows(matrix)})
                    objects.append(Object(mesh=found, transform=transform, material=materials[id(primitive)]))
                    of.append(node)
    return objects, of


# --- meshes ----------------------------------------------------------------------------------------------------------

# What was made of a primitive, and the arrays that it was made of. pyrender uploads them once; a new array counts as a change.
_meshes: WeakKeyDictionary[Any, tuple[tuple[Any, ...], Mesh]] = WeakKeyDictionary()


def mesh(primitive: Any) -> Mesh | None:
    """The triangles of a primitive; None where it has none. Errors: AssetError."""
    p = primitive
    arrays = (p.positions, p.indices, p.normals, p.texcoord_0, p.color_0, p.mode)
    known = _meshes.get(p)
    if known is not None and all(one is other for one, other in zip(known[0], arrays, strict=True)):
        return known[1]
    if p.mode in MODES:
        warnings.warn(f"{MODES[p.mode]} are not drawn, triangles alone", AssetWarning, stacklevel=2)
        return None
    order = np.arange(len(p.positions)) if p.indices is None else np.asarray(p.indices).reshape(-1).astype(np.int64)
    triangles = _triangles(order, p.mode)
    if not len(triangles):
        return None
    # pyrender's texture coordinates start at the bottom left too; its vertex colours are linear.
    made = Mesh.build(p.positions, triangles, p.normals, p.texcoord_0, p.color_0)
    _meshes[p] = arrays, made
    return made


def _triangles(order: NDArray[np.int64], mode: int) -> NDArray[np.int64]:
    """(T, 3) of the vertices in the order in which GL is given them."""
    if mode == TRIANGLES:
        return order[: len(order) // 3 * 3].reshape(-1, 3)
    first = order[: max(len(order) - 2, 0)]
    second, third = order[1 : 1 + len(first)], order[2:]
    if mode == FAN:
        return np.stack([np.broadcast_to(order[:1], first.shape), second, third], axis=1)
    # Every other triangle of a strip is turned, so that all wind alike.
    odd = np.arange(len(first)) % 2 == 1
    return np.stack([np.where(odd, second, first), np.where(odd, first, second), third], axis=1)


# --- materials -------------------------------------------------------------------------------------------------------


def material(primitive: Any, flat: bool, both: bool) -> Brdf:
    """The material of a primitive. pyrender's materials are glTF's, key by key. Errors: SceneError."""
    given = primitive.material
    name = given.name or ""
    header: dict[str, list[Any]] = {"textures": [], "samplers": [], "images": []}

    def texture(slot: str) -> dict[str, Any] | None:
        """glTF's textureInfo of one of the material's textures."""
        found = getattr(given, slot, None)
        path = picture(found) if found is not None and primitive.texcoord_0 is not None else None
        if found is None or path is None:
            return None
        index = len(header["textures"])
        header["textures"].append({"source": index, "sampler": index})
        header["samplers"].append({"wrapS": found.sampler.wrapS, "wrapT": found.sampler.wrapT})
        header["images"].append({"uri": quote(str(path))})
        return {"index": index}

    table: dict[str, Any] = {"name": name, "alphaMode": given.alphaMode, "alphaCutoff": given.alphaCutoff}
    glossy = hasattr(given, "diffuseFactor")
    base, picture_of = ("diffuseFactor", "diffuseTexture") if glossy else ("baseColorFactor", "baseColorTexture")
    factor = np.clip(np.asarray(getattr(given, base), dtype=np.float64), 0, 1)
    if given.alphaMode == "BLEND" and not _seen_through(factor[3], getattr(given, picture_of), primitive):
        # pyrender blends whatever it makes of a trimesh; what cannot be seen through is drawn as what it is.
        table["alphaMode"] = "OPAQUE"
    if flat or not glossy:
        info = {"baseColorFactor": factor.tolist(), "baseColorTexture": texture(picture_of)}
        # The texture's first two channels, wherever they came from, as in pyrender's shader.
        packed = {} if flat else {"metallicRoughnessTexture": texture("metallicRoughnessTexture")}
        numbers = {} if flat else {"metallicFactor": given.metallicFactor, "roughnessFactor": given.roughnessFactor}
        table["pbrMetallicRoughness"] = {**info, **packed, **numbers}
    else:
        specular = np.clip(np.asarray(given.specularFactor, dtype=np.float64), 0, 1).tolist()
        old: dict[str, Any] = {"diffuseFactor": factor.tolist(), "diffuseTexture": texture(picture_of)}
        # The property calls itself without end in pyrender 0.1.45.
        old |= {"specularFactor": specular, "glossinessFactor": given._glossinessFactor}
        if given.specularGlossinessTexture is not None:
            old["specularGlossinessTexture"] = {}
        table["extensions"] = {"KHR_materials_pbrSpecularGlossiness": old}
    if not flat:
        table["emissiveFactor"] = np.asarray(given.emissiveFactor).tolist()
        normals = texture("normalTexture")
        table |= {"normalTexture": normals} if normals else {}
        if given.occlusionTexture is not None:
            table["occlusionTexture"] = {}
    return _made(table, header, flat, both or given.doubleSided, given.wireframe)


def _seen_through(alpha: float, texture: Any, primitive: Any) -> bool:
    """Whether any of the surface lets light through."""
    colours = primitive.color_0
    textured = texture is not None and texture.source is not None and primitive.texcoord_0 is not None
    return bool(
        alpha < 1
        or (colours is not None and colours.shape[1] == 4 and (colours[:, 3] < 1).any())
        or (textured and (rgba(texture.source)[..., 3] < 255).any())
    )


def _made(table: dict[str, Any], header: dict[str, Any], flat: bool, both: bool, wireframe: bool) -> Brdf:
    """The model of a glTF material. Errors: SceneError."""
    notes = File(Path("pyrender"), Path("/"), b"")
    keys = gltf_material.material(notes, header, [], table)
    keys["sides"] = "both" if both else "front"
    for line in notes.contents.warnings + ["pyrender: wireframes are drawn solid"] * wireframe:
        warnings.warn(line, AssetWarning, stacklevel=2)
    if isinstance(keys.get("roughness"), dict):
        # pyrender's shader reads roughness from red and metallic from green: it has put glTF's green and blue there.
        keys["roughness"]["channel"] = "r"
    if isinstance(keys.get("metallic"), dict):
        keys["metallic"]["channel"] = "g"
    if flat:
        base = keys["kd"]
        # Unlit base colours are shown as they are, without decoding.
        base = {**base, "encoding": "linear"} if isinstance(base, dict) else base
        kept: set[str] = {"alpha", "alpha_mode", "alpha_cutoff", "sides"} & set(keys)
        keys = {"brdf": "ambient", "ka": base, **{name: keys[name] for name in kept}}
    try:
        return BRDFS[keys["brdf"]].model_validate(keys)
    except ValidationError as error:
        faults = error.errors(include_url=False)
        raise SceneError([f"{'.'.join(map(str, fault['loc']))}: {fault['msg']}" for fault in faults]) from None


# --- lights ----------------------------------------------------------------------------------------------------------


def lights(scene: Any) -> tuple[Light, ...]:
    """All lights. E lux, or E candela, are an intensity of E / pi: that of a white Lambertian that faces the light."""
    return tuple(LIGHTS[table["type"]].model_validate(table) for table in _lights(scene))


def _lights(scene: Any) -> Iterator[dict[str, Any]]:
    if np.any(scene.ambient_light):
        yield {"type": "ambient", "colour": _three(scene.ambient_light)}

    def ordered(nodes: Iterable[Any]) -> list[tuple[Any, Array]]:
        # Sums are rounded in their order, and a set has none.
        placed = [(node.light, scene.get_pose(node)) for node in nodes]
        return sorted(placed, key=lambda pair: pair[1].tobytes())

    def common(light: Any) -> dict[str, Any]:
        return {"colour": _three(light.color), "intensity": light.intensity / math.pi, "name": light.name}

    for light, pose in ordered(scene.directional_light_nodes):
        yield {"type": "directional", **common(light), "direction": _three(-pose[:3, 2])}
    for light, pose in ordered(scene.point_light_nodes):
        yield {"type": "point", **common(light), "position": _three(pose[:3, 3]), "r_min": R_MIN}
    for light, pose in ordered(scene.spot_light_nodes):
        cone = {"inner": math.degrees(light.innerConeAngle), "outer": math.degrees(light.outerConeAngle)}
        where = {"direction": _three(-pose[:3, 2]), "position": _three(pose[:3, 3]), "r_min": R_MIN}
        yield {"type": "gltf_spot", **common(light), **where, **cone}


def _three(values: Any) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values[:3])
    return x, y, z
