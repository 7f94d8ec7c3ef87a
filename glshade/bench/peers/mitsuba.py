"""Mitsuba: a peer that traces one ray a pixel, compiled by LLVM, with its model of rough plastic."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from glshade.bench.stage import COLOURS, EYE, FAR, FOV, KD, NEAR, POSITIONS, TO_LIGHT, WorkFiles

VARIANT = "llvm_ad_rgb"
mi.set_variant(VARIANT)


class Peer:
    """Mitsuba's integrator of direct light, with a box filter and one sample a pixel."""

    def __init__(self, stage: WorkFiles) -> None:
        self.driver = f"Mitsuba {mi.__version__} {VARIANT}"
        positions, triangles = stage.arrays()
        properties = mi.Properties()
        # This alpha gives a lobe as wide as that of a Phong exponent n of 32: alpha = sqrt(2 / (n + 2)).
        plastic = {"type": "roughplastic", "diffuse_reflectance": {"type": "rgb", "value": list(KD)}, "alpha": 0.24}
        properties["material"] = mi.load_dict(plastic)
        mesh = mi.Mesh("sphere", len(positions), len(triangles), has_vertex_normals=True, props=properties)
        arrays = mi.traverse(mesh)
        arrays["vertex_positions"] = arrays["vertex_normals"] = positions.ravel()
        arrays["faces"] = triangles.ravel()
        arrays.update()
        film = {"type": "hdrfilm", "width": stage.side, "height": stage.side, "pixel_format": "rgb", "rfilter": {"type": "box"}}
        camera = {"type": "perspective", "fov": FOV, "fov_axis": "y", "near_clip": NEAR, "far_clip": FAR}
        self._scene = mi.load_dict(
            {
                "type": "scene",
                "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0},
                "mesh": mesh,
                "sensor": {
                    **camera,
                    "to_world": _toward_origin(EYE),
                    "film": film,
                    "sampler": {"type": "independent", "sample_count": 1},
                },
                **_lights(stage.lights),
            }
        )
        self._parameters = mi.traverse(self._scene)
        self._eye = EYE

    def _render(self, eye: tuple[float, float, float]) -> Any:
        if eye != self._eye:
            self._eye = eye
            self._parameters["sensor.to_world"] = _toward_origin(eye)
            self._parameters.update()
        return mi.render(self._scene, spp=1)

    def frame(self, eye: tuple[float, float, float]) -> NDArray[Any]:
        codes: NDArray[Any] = np.clip(np.asarray(self._render(eye)), 0.0, 1.0) * 255 + 0.5
        return codes.astype(np.uint8)

    def save(self, eye: tuple[float, float, float], path: str) -> None:
        mi.util.write_bitmap(path, self._render(eye), write_async=False)


def _toward_origin(eye: tuple[float, float, float]) -> Any:
    return mi.ScalarTransform4f().look_at(origin=list(eye), target=[0, 0, 0], up=[0, 1, 0])


def _lights(kind: str) -> dict[str, Any]:
    if kind == "directional":
        light = {"type": "directional", "direction": [-x for x in TO_LIGHT], "irradiance": {"type": "rgb", "value": np.pi}}
        return {"light": light}
    return {
        # Mitsuba's light falls off with the square of the distance. The distance is about 3, so a factor of 9 makes up for it.
        f"light{i}": {"type": "point", "position": p, "intensity": {"type": "rgb", "value": c}}
        for i, (p, c) in enumerate(zip(POSITIONS.tolist(), (COLOURS * 9 * np.pi).tolist(), strict=True))
    }
