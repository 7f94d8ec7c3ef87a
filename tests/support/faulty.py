"""Faulty: a small scene, and pictures of it that the float64 reference draws with a fault on purpose."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.image import file as picture_file
from glshade.image.contents import PictureContents
from glshade.image.image import Image
from glshade.reference.picture import radiance
from glshade.scene.scene import Scene

# Width and height of the picture. It is small, and has so few outlines that the reference can judge it [pixels].
SIZE = (96, 72)
PHONG = {"brdf": "phong", "kd": (0.5, 0.3, 0.2), "ks": 0.3, "exponent": 20.0}
SCENE: dict[str, Any] = {
    "film": {"size": SIZE, "background": (0.05, 0.06, 0.08)},
    "camera": {"type": "orthographic", "eye": (0, 0, 9), "height": 4.5},
    "objects": [
        {
            "name": "wall",
            "shape": {"type": "cube"},
            "transform": {"translate": (0, 0, -3), "scale": (9, 9, 1)},
            "material": {"brdf": "lambert", "kd": (0.5, 0.6, 0.4)},
        },
        {"name": "ball", "shape": {"type": "sphere", "segments": 48, "rings": 24}, "material": PHONG},
    ],
    "lights": [
        {"type": "point", "name": "key", "position": (4, 4, 6), "intensity": 25.0},
        {"type": "directional", "name": "fill", "direction": (2, 0, -1), "intensity": 0.2, "colour": (0.6, 0.8, 1.0)},
        {"type": "ambient", "intensity": 0.05},
    ],
}


def scene(change: Callable[[dict[str, Any]], None] | None = None) -> Scene:
    """Returns the scene, or the scene that a function makes of its description."""
    from copy import deepcopy

    description = deepcopy(SCENE)
    if change is not None:
        change(description)
    return Scene.model_validate(description)


def drawn(of: Scene) -> NDArray[np.float32]:
    """Returns the reference's picture (H, W, 3) of a scene, linear."""
    return radiance(of)[..., :3].astype(np.float32)


def codes(picture: NDArray[Any]) -> NDArray[np.uint8]:
    """Returns the sRGB-encoded 8-bit codes of a linear picture."""
    return Image(picture.astype(np.float32)).encoded().pixels


def save(path: Path, pixels: NDArray[Any], **attributes: str) -> Path:
    """Writes a picture file, and returns its path."""
    encoding = "srgb" if pixels.dtype == np.uint8 else "linear"
    picture_file.write(path, PictureContents(pixels, encoding, premultiplied=False, attributes=attributes))
    return path
