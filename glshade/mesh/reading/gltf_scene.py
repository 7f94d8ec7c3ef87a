"""glTF scene: the cameras and lights of a glTF file, as tables of a scene file in file space."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from glshade.arrays import Float64
from glshade.errors import printable
from glshade.mesh.reading.file import MeshFile, short
from glshade.mesh.reading.gltf_nodes import is_flat

# The widest angle of a camera or a cone that a scene file takes, which allows no half-plane [degrees].
WIDEST_VIEW, WIDEST_CONE = 179.0, 90.0
# The default outer angle of a spot light [radians] (KHR_lights_punctual, "Spot").
OUTER = math.pi / 4


def add_camera(file: MeshFile, number: int, camera: dict[str, Any], node: dict[str, Any], world: Float64) -> None:
    """Adds a camera of the file to its contents, under the name of its node, or else its own.

    number: the camera's number in the file.
    camera, node: the JSON of the camera and of its node.
    world: (4, 4), the node's transform to file space. Its scale does not matter (glTF 2.0, 3.10).
    """
    kind = camera["type"]
    given = camera.get(kind)
    if kind not in ("perspective", "orthographic") or given is None:
        file.warn(f"cameras[{number}] is of the type {short(kind)}, or has no table of that name; it is left out")
        return
    table: dict[str, Any] = {"type": kind, "matrix": world.tolist()}
    if kind == "perspective":
        angle = math.degrees(given["yfov"])
        size = given["yfov"]
        table["fov"] = min(angle, WIDEST_VIEW)
    else:
        size = table["height"] = 2 * abs(given["ymag"])
    near, far = given["znear"], given.get("zfar", 0.0)
    # A perspective camera without zfar sees infinitely far (glTF 2.0, 3.10.3.4). Then the scene itself ends the view.
    if far > near:
        table["far"] = far
    elif "zfar" in given:
        file.warn(f"cameras[{number}]: its zfar {far:g} is not larger than its znear {near:g}; drawn without it")
    if near > 0 or kind == "orthographic":
        table["near"] = near
    if size <= 0 or is_flat(world):
        file.warn(f"cameras[{number}] has no extent: its angle, its height or its node's scale is 0; it is left out")
        return
    name = printable(node.get("name") or camera.get("name") or f"camera {number}")
    unique, count = name, 1
    while unique in file.contents.cameras:
        count += 1
        unique = f"{name}.{count}"
    file.contents.cameras[unique] = table


def add_light(file: MeshFile, number: int, light: dict[str, Any], world: Float64) -> None:
    """Adds a light of KHR_lights_punctual to the contents of the file.

    The file gives lux for directional lights and candela for the others. A white Lambertian surface that faces a light of I
    candela at distance 1 has the luminance I / pi [cd/m2], and one that faces E lux has E / pi.

    number: the light's number in the file.
    light: the JSON of the light.
    world: (4, 4), the transform of its node to file space. Its scale does not matter.
    """
    kind = light["type"]
    if kind not in ("directional", "point", "spot"):
        file.warn(f"light {number} is of the type {short(kind)}, which KHR_lights_punctual does not have; it is left out")
        return
    table: dict[str, Any] = {
        "type": "gltf_spot" if kind == "spot" else kind,
        "colour": [float(c) for c in light.get("color", (1.0, 1.0, 1.0))],
        "intensity": light.get("intensity", 1.0) / math.pi,
    }
    if light.get("name"):
        table["name"] = printable(light["name"])
    if kind != "directional":
        table["position"] = world[:3, 3].tolist()
        if "range" in light:
            file.warn(f"light {number}: its range is not used; it shines on as the inverse square of the distance")
    if kind != "point":
        axis = -world[:3, 2]
        # A node that is scaled to 0 gives no direction, so that of the untransformed light is taken.
        table["direction"] = (axis / np.linalg.norm(axis)).tolist() if axis.any() else [0.0, 0.0, -1.0]
    if kind == "spot":
        cone = light.get("spot", {})
        outer = min(max(math.degrees(cone.get("outerConeAngle", OUTER)), 1e-3), WIDEST_CONE)
        table |= {"inner": min(max(math.degrees(cone.get("innerConeAngle", 0.0)), 0.0), outer), "outer": outer}
    file.contents.lights.append(table)
