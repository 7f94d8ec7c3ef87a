"""pyrender: a peer with its own model of a glossy dielectric, and four samples a pixel, which cannot be turned off."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

os.environ.setdefault("PYOPENGL_PLATFORM", "egl")

import pyrender
import pyrender.renderer
from OpenGL.GL import GL_RENDERER, GL_VERSION, glGetString

from glshade.bench.stage import AMBIENT, COLOURS, EYE, FAR, FOV, KD, LAMPS, NEAR, POSITIONS, TO_LIGHT, WorkFiles, look_at

# By default pyrender draws no more than four lights of each kind.
pyrender.renderer.MAX_N_LIGHTS = LAMPS


class Peer:
    """Draws with pyrender's OffscreenRenderer."""

    def __init__(self, stage: WorkFiles) -> None:
        positions, triangles = stage.arrays()
        # This roughness is as glossy as a Phong exponent n of 32: alpha = sqrt(2 / (n + 2)), roughness = sqrt(alpha).
        material = pyrender.MetallicRoughnessMaterial(baseColorFactor=(*KD, 1.0), metallicFactor=0.0, roughnessFactor=0.5)
        sphere = pyrender.Primitive(positions=positions, normals=positions, indices=triangles, material=material, mode=4)
        self._scene = pyrender.Scene(bg_color=(0.0, 0.0, 0.0, 0.0), ambient_light=(AMBIENT,) * 3)
        self._scene.add(pyrender.Mesh([sphere]))
        camera = pyrender.PerspectiveCamera(np.radians(FOV), znear=NEAR, zfar=FAR)
        self._camera = self._scene.add(camera, pose=np.linalg.inv(look_at(EYE)))
        if stage.lights == "directional":
            # An illuminance of E lux corresponds to an intensity of E / pi in glshade.
            sun = pyrender.DirectionalLight(color=np.ones(3), intensity=np.pi)
            self._scene.add(sun, pose=np.linalg.inv(look_at(TO_LIGHT)))
        else:
            for position, colour in zip(POSITIONS, COLOURS, strict=True):
                pose = np.eye(4)
                pose[:3, 3] = position
                # pyrender's light falls off with the square of the distance. The distance is about 3, so a factor of 9 makes up
                # for it.
                self._scene.add(pyrender.PointLight(color=colour, intensity=9 * np.pi), pose=pose)
        self._renderer = pyrender.OffscreenRenderer(stage.side, stage.side)
        self._renderer._platform.make_current()
        self.driver = "; ".join(glGetString(name).decode() for name in (GL_RENDERER, GL_VERSION))

    def frame(self, eye: tuple[float, float, float]) -> NDArray[Any]:
        self._scene.set_pose(self._camera, np.linalg.inv(look_at(eye)))
        colour, _depth = self._renderer.render(self._scene)
        pixels: NDArray[Any] = colour
        return pixels

    def save(self, eye: tuple[float, float, float], path: str) -> None:
        from PIL import Image

        Image.fromarray(self.frame(eye)).save(path)
