"""Drawn: a drawer in this process with a scene of its own, whose files a test edits."""

from __future__ import annotations

import ctypes
import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image as Pillow

from glshade.gl.context import Context
from glshade.glsl.shaders import SHIPPED
from glshade.live.drawer import Drawer
from glshade.live.messages import Answer, Draw, Frame, Load, Loaded

SCENE = """
description = "two spheres"

[film]
size = [48, 32]

[camera]
eye = [0, 0, 6]
target = [0, 0, 0]

[cameras.side]
eye = [6, 0, 0]
target = [0, 0, 0]

[materials.left]
brdf = "phong"
kd = [0.6, 0.3, 0.1]
ks = 0.3
exponent = 20

[materials.right]
brdf = "lambert"
kd = [0.2, 0.4, 0.8]

[[objects]]
name = "one"
shape = "sphere"
material = "left"
transform = { translate = [-1.2, 0, 0] }

[[objects]]
name = "two"
shape = "sphere"
material = "right"
transform = { translate = [1.2, 0, 0] }

[[lights]]
name = "sun"
type = "directional"
direction = [-1, -1, -2]
"""

# A camera from which the scene looks different.
FROM_ABOVE = {"camera": {"eye": [0, 5, 3], "target": [0, 0, 0], "up": [0, 1, 0], "fov": 40}}
# The kinds of GL objects whose number is counted, by the function that tells whether a name is one of them.
KINDS = ("glIsProgram", "glIsShader", "glIsTexture", "glIsBuffer", "glIsVertexArray", "glIsFramebuffer", "glIsRenderbuffer")
# The largest name that is looked at. Mesa gives each program a name that no earlier one had.
LARGEST_NAME = 100_000


class Drawn:
    """A drawer and the files of its scene.

    folder: the folder of the scene file, which is `scene`.
    shaders: a shader folder with the shipped files brdf/phong.glsl and brdf/lambert.glsl.
    """

    def __init__(self, folder: Path, text: str = SCENE) -> None:
        self.folder = folder
        self.scene = folder / "scene.toml"
        self.scene.write_text(text)
        self.shaders = folder / "shaders"
        (self.shaders / "brdf").mkdir(parents=True)
        for name in ("phong", "lambert"):
            self.write(name, self.shipped(name))
        self.drawer = Drawer("auto", "", str(folder / "work"))
        self.number = 0

    @staticmethod
    def shipped(name: str) -> str:
        """Returns the text of a shipped model."""
        return (SHIPPED / "brdf" / f"{name}.glsl").read_text()

    def write(self, name: str, text: str) -> None:
        """Writes a model's file."""
        (self.shaders / "brdf" / f"{name}.glsl").write_text(text)

    def request(self, **more: Any) -> Load:
        """Returns a request to load the scene as the next revision."""
        self.number += 1
        return Load(revision=self.number, scene=str(self.scene), shaders=(str(self.shaders),), **more)

    def ask(self, request: Any) -> Answer:
        """Returns the drawer's answer, after it has done all the work that an answer leaves."""
        answer = self.drawer.answer(request)
        self.drawer.answered()
        self.drawer.idle()
        return answer

    def load(self, **more: Any) -> Loaded:
        """Returns the answer to a request to load the scene."""
        answer = self.ask(self.request(**more))
        assert isinstance(answer, Loaded)
        return answer

    def draw(self, still: bool = True, **view: Any) -> Frame:
        """Returns the picture of a view."""
        answer = self.ask(Draw(view=view, still=still))
        assert isinstance(answer, Frame), answer
        return answer

    def pixels(self, **view: Any) -> NDArray[np.uint8]:
        """Returns the pixels (H, W, C) of the still picture of a view."""
        return pixels_of(self.draw(**view))

    def objects(self) -> dict[str, int]:
        """Kind of GL object -> their number."""
        return objects(self.drawer.renderer.context)


def pixels_of(frame: Frame) -> NDArray[np.uint8]:
    """Returns the pixels (H, W, C) of a picture."""
    return np.asarray(Pillow.open(io.BytesIO(frame.data)))


def objects(context: Context) -> dict[str, int]:
    """Kind of GL object -> the number of objects in a context."""
    with context.gl as gl:
        gl.gc()
        counts = {}
        for name in KINDS:
            asked = context.procedure(name, ctypes.c_ubyte, ctypes.c_uint)
            assert asked is not None
            counts[name] = sum(bool(asked(number)) for number in range(1, LARGEST_NAME))
    return counts


@contextmanager
def drawn(folder: Path, text: str = SCENE) -> Iterator[Drawn]:
    """Returns a drawer, whose context is released at the end."""
    made = Drawn(folder, text)
    try:
        yield made
    finally:
        made.drawer.renderer.release()
