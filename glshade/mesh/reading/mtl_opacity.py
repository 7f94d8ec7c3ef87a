"""MTL opacity: the keys of a material that is transparent in places, by a number or by a picture."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from glshade.arrays import Array
from glshade.errors import AssetError
from glshade.limits import TEXELS_PER_BYTE
from glshade.mesh.reading.contents import EMBEDDED, Material
from glshade.mesh.reading.file import MeshFile

# A picture in which at most this share of the texels is neither opaque nor invisible cuts out shapes, such as leaves. It is
# drawn as a mask, which needs no order of drawing; the rest are the smooth edges of the shapes.
BETWEEN = 0.1


def opacity(file: MeshFile, material: Material, alpha: float, mask: Material | None) -> Material:
    """Returns the keys that make a material transparent; none for one that is opaque everywhere.

    alpha: the opacity of the whole material.
    mask: the table of the picture whose values are multiplied by it, or None. The alpha of the base texture is the only one
        that varies over a surface, so the picture is put into a copy of that texture.
    """
    if mask is None:
        return {"alpha": alpha, "alpha_mode": "blend"} if alpha < 1 else {}
    pixels = _pixels(file, mask["texture"])
    if pixels is None:
        return {"alpha": alpha, "alpha_mode": "blend"} if alpha < 1 else {}
    opaque = _channel(pixels, mask.get("channel"))
    base = material["kd"] if isinstance(material["kd"], dict) else None
    if base is None:
        keys = {key: value for key, value in mask.items() if key != "channel"}
        base = {**keys, "factor": material["kd"]}
        colours = np.ones((*opaque.shape, 3), dtype=np.float32)
    else:
        if any(base.get(key) != mask.get(key) for key in ("uv_scale", "uv_offset", "wrap")):
            file.warn("a picture of opacity is placed as the picture of colours, although their options differ")
        found = _pixels(file, base["texture"])
        colours = (np.ones((1, 1, 3), dtype=np.float32) if found is None else found)[..., :3]
    path = _store(file, material, base["texture"], mask["texture"], colours, opaque)
    between = float(np.mean((opaque > 0.05) & (opaque < 0.95)))
    keys = {"kd": {**base, "texture": path}}
    return keys | {"alpha": alpha, "alpha_mode": "blend" if alpha < 1 or between > BETWEEN else "mask"}


def _pixels(file: MeshFile, path: str) -> Any:
    """Returns the sRGB-encoded values (H, W, 4) of a picture; None, with a warning, where it is broken or too large."""
    from glshade.image import file as picture_file
    from glshade.image.srgb import linear_to_srgb

    data = file.read(Path(path))
    try:
        if picture_file.pixel_count(path) > max(file.limits.max_texels, TEXELS_PER_BYTE * len(data or b"")):
            file.warn(f"texture '{Path(path).name}' has too many pixels to be one of opacity; drawn without it")
            return None
        stored, shown = (picture_file.read(path, encoding)[0] for encoding in ("linear", "auto"))
        # The values of a picture of floats are linear.
        return np.dstack([linear_to_srgb(shown[..., :3]), shown[..., 3]]) if np.array_equal(stored, shown) else stored
    except AssetError:
        file.warn(f"texture '{Path(path).name}' cannot be decoded; drawn without it")
        return None


def _channel(pixels: Array, channel: str | None) -> Array:
    """Returns the opacities (H, W): those of a channel; without one, of alpha where it varies, or else of red."""
    if channel:
        return pixels[..., "rgba".index(channel)]
    return pixels[..., 3] if (pixels[..., 3] < 1).any() else pixels[..., 0]


def _store(file: MeshFile, material: Material, base: str, mask: str, colours: Array, opaque: Array) -> str:
    """Returns the path of a picture of the colours (h, w, 3) with the opacities (H, W) as alpha, in the size of the larger."""
    from glshade.image import Image

    height, width = (max(a, b) for a, b in zip(colours.shape[:2], opaque.shape, strict=True))
    rows, columns = np.arange(height), np.arange(width)

    def enlarged(x: Array) -> Array:
        result: Array = x[rows[:, None] * x.shape[0] // height, columns * x.shape[1] // width]
        return result

    pixels = np.concatenate([enlarged(colours), enlarged(opaque)[..., None]], axis=-1)
    name = f"opacity{len(file.contents.images)}.png"
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / name
        Image(np.round(np.clip(pixels, 0, 1) * 255).astype(np.uint8)).save(target)
        file.contents.images[name] = target.read_bytes()
    return EMBEDDED + name
