"""Textures of pyrender's scenes: from the array to the GPU without a file, and freed with their owners."""

from __future__ import annotations

import gc
import tempfile
import weakref
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glshade
from glshade import from_pyrender
from glshade.pyrender import OffscreenRenderer, RenderFlags
from glshade.textures.pixel_array import PixelArray

pyrender = pytest.importorskip("pyrender", reason="the extra pyrender is not installed")

CODES = np.random.default_rng(1).integers(0, 256, (8, 6, 4)).astype(np.uint8)
CORNERS = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], dtype=np.float32)


def scene(source: Any, channels: str = "RGBA", **changes: Any) -> Any:
    """Returns a scene with one textured square. changes: attributes of its material."""
    texture = pyrender.Texture(source=source, source_channels=channels)
    material = pyrender.MetallicRoughnessMaterial(baseColorTexture=texture, **changes)
    primitive = pyrender.Primitive(
        positions=CORNERS,
        normals=np.tile(np.float32([0, 0, 1]), (4, 1)),
        texcoord_0=(CORNERS[:, :2] + 1) / 2,
        indices=np.array([[0, 1, 2], [0, 2, 3]]),
        material=material,
    )
    made = pyrender.Scene(ambient_light=[1.0, 1.0, 1.0])
    made.add(pyrender.Mesh([primitive]))
    pose = np.eye(4)
    pose[2, 3] = 3
    made.add(pyrender.PerspectiveCamera(yfov=0.6), pose=pose)
    return made


def material_of(given: Any) -> Any:
    """Returns the converted material of the scene's square."""
    return from_pyrender(given).objects[0].material


def test_no_file_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # Temporary files cannot be made in a folder that does not exist.
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "missing"))
    given = scene(CODES, alphaMode="MASK")
    renderer = OffscreenRenderer(16, 12)
    colours, _ = renderer.render(given)
    renderer.render(given, RenderFlags.SEG, dict.fromkeys(given.mesh_nodes, (9, 8, 7)))
    glshade.render(from_pyrender(given))
    renderer.delete()
    assert len(np.unique(colours.reshape(-1, 3), axis=0)) > 10


@pytest.mark.parametrize(
    ("source", "channels"),
    [(CODES, "RGBA"), (CODES[..., :3], "RGB"), (CODES[..., 0], "R"), (CODES[..., :2], "RG"), (CODES / 255.0, "RGBA")],
)
def test_the_pixels_are_those_that_opengl_gets(source: Any, channels: str) -> None:
    expected = np.zeros_like(CODES)
    expected[..., 3] = 255
    expected[..., : len(channels)] = CODES[..., : len(channels)]
    pixels = material_of(scene(source, channels)).kd.texture.pixels
    # Three channels have an alpha of 1.
    assert pixels.shape[2] == (4 if channels == "RGBA" else 3)
    np.testing.assert_array_equal(pixels, expected[..., : pixels.shape[2]])


def test_a_new_array_is_a_new_texture() -> None:
    given = scene(CODES)
    before = material_of(given).kd.texture
    assert material_of(given).kd.texture is before
    (node,) = given.mesh_nodes
    node.mesh.primitives[0].material.baseColorTexture.source = 255 - CODES
    np.testing.assert_array_equal(material_of(given).kd.texture.pixels, 255 - CODES)


def test_a_texture_is_freed_with_its_owners() -> None:
    # No other test uses these pixels, so no cache of another renderer holds them.
    codes = CODES[::-1]
    given = scene(codes, alphaMode="MASK")
    renderer = OffscreenRenderer(16, 12)
    renderer.render(given)
    renderer.render(given, RenderFlags.SEG, dict.fromkeys(given.mesh_nodes, (9, 8, 7)))
    white = np.concatenate([np.full_like(codes[..., :3], 255), codes[..., 3:]], axis=2)
    pictures = [weakref.ref(PixelArray.of(pixels)) for pixels in (codes, white)]
    assert all(picture() is not None for picture in pictures)
    renderer.delete()
    del given, renderer
    gc.collect()
    assert all(picture() is None for picture in pictures)
