"""Pixel arrays: textures from arrays draw what files of the same pixels draw, and are freed with the scenes that hold them."""

from __future__ import annotations

import gc
import pickle
import tempfile
import weakref
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import glshade
from glshade import Mesh, Renderer, Scene, SceneError, Texture
from glshade.assembly.counting import check_texels
from glshade.image import file as picture_file
from glshade.image.file import Encoding
from glshade.limits import Limits
from glshade.scene.digest import scene_digest
from glshade.textures.pixel_array import PixelArray

CODES = np.random.default_rng(5).integers(0, 256, (5, 7, 4)).astype(np.uint8)
# Mesh.build keeps no reference to the arrays, so every test may use this mesh.
SQUARE = Mesh.build(
    np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], dtype=float),
    np.array([[0, 1, 2], [0, 2, 3]]),
    uvs=np.array([[0, 0], [2, 0], [2, 2], [0, 2]], dtype=float),
)


def textured(source: Any, **keys: Any) -> Scene:
    """Returns a scene that shows a square with a texture. keys: further keys of the material."""
    material = {"brdf": "lambert", "kd": {"texture": source}, **keys}
    lights = [{"type": "ambient"}, {"type": "directional", "direction": [0, 0, -1]}]
    return Scene.model_validate(
        {"objects": [{"mesh": SQUARE, "material": material}], "lights": lights, "film": {"size": [24, 16]}}
    )


def saved(path: Path, pixels: Any) -> Path:
    """Writes pixels (H, W, C) to a file with OpenImageIO, not with glshade, and returns its path."""
    output = oiio.ImageOutput.create(str(path))
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], str(pixels.dtype).replace("float32", "float"))
    # Without this, OpenImageIO takes the colours as premultiplied by alpha.
    spec.attribute("oiio:UnassociatedAlpha", 1)
    if pixels.shape[2] % 2 == 0:
        spec.alpha_channel = pixels.shape[2] - 1
    assert output.open(str(path), spec)
    assert output.write_image(np.ascontiguousarray(pixels))
    output.close()
    return path


shapes = st.tuples(st.integers(1, 4), st.integers(1, 4), st.integers(1, 4))


@given(pixels=shapes.flatmap(lambda shape: arrays(np.uint8, shape)), encoding=st.sampled_from(["auto", "srgb", "linear"]))
def test_codes_are_read_like_a_png_file_to_the_last_bit(pixels: Any, encoding: Encoding) -> None:
    with tempfile.TemporaryDirectory() as folder:
        expected, _ = picture_file.read(saved(Path(folder) / "t.png", pixels), encoding)
    np.testing.assert_array_equal(picture_file.for_texture(PixelArray.of(pixels).contents, encoding)[0], expected)


@pytest.mark.parametrize("encoding", ["auto", "srgb", "linear"])
def test_floats_are_read_like_an_openexr_file(encoding: Encoding, tmp_path: Path) -> None:
    pixels = np.linspace(0, 4, 2 * 3 * 3, dtype=np.float32).reshape(2, 3, 3)
    expected, _ = picture_file.read(saved(tmp_path / "t.exr", pixels), encoding)
    np.testing.assert_array_equal(picture_file.for_texture(PixelArray.of(pixels).contents, encoding)[0], expected)
    doubles = PixelArray.of(pixels.astype(np.float64)).contents
    np.testing.assert_array_equal(picture_file.for_texture(doubles, encoding)[0], expected)


@pytest.mark.parametrize("use", ["kd", "normal_map", "bump_map", "alpha"])
def test_both_renderers_draw_an_array_like_its_file(use: str, tmp_path: Path) -> None:
    def scene(source: Any) -> Scene:
        if use == "alpha":
            return textured(source, alpha_mode="mask")
        return textured(source, **({} if use == "kd" else {use: {"texture": source}}))

    path = saved(tmp_path / "t.png", CODES)
    np.testing.assert_array_equal(glshade.render(scene(CODES)).pixels, glshade.render(scene(path)).pixels)
    expected = glshade.reference.render(scene(path)).pixels
    np.testing.assert_array_equal(glshade.reference.render(scene(CODES)).pixels, expected)
    assert np.ptp(expected[..., 0]) > 0


def test_equal_pixels_are_one_picture_and_others_are_not() -> None:
    given = CODES.copy()
    first, again = PixelArray.of(given), PixelArray.of(CODES)
    assert first is again
    assert pickle.loads(pickle.dumps(first)) is first
    given[0, 0, 0] ^= 1
    np.testing.assert_array_equal(first.pixels, CODES)
    others = [given, CODES.reshape(7, 5, 4), CODES[..., :3], CODES.astype(np.float32)]
    assert len({first.digest, *(PixelArray.of(other).digest for other in others)}) == 5


def test_the_digest_of_a_scene_counts_the_pixels() -> None:
    other = CODES.copy()
    other[0, 0, 0] ^= 1
    written = [Texture(texture=pixels).model_dump_json() for pixels in (CODES, CODES.copy(), other)]
    assert written[0] == written[1] != written[2]
    assert scene_digest(textured(CODES)) == scene_digest(textured(CODES.copy())) != scene_digest(textured(other))


@pytest.mark.parametrize(
    ("array", "message"),
    [
        (np.zeros((2, 2, 5), np.uint8), r"must have the shape \(H, W\) or \(H, W, 1 to 4\), not \(2, 2, 5\)"),
        (np.zeros((0, 2), np.uint8), r"must have the shape"),
        (np.zeros(4, np.uint8), r"must have the shape"),
        (np.zeros((2, 2), np.int64), "must have the type uint8 or a type of floats, not int64"),
        (np.zeros((2, 2), object), "must have the type uint8"),
        (np.full((2, 2), np.nan), "must hold finite numbers"),
        (np.full((2, 2), 1e300), "must hold finite numbers"),
    ],
)
def test_other_arrays_are_refused_with_the_reason(array: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Texture(texture=array)


def test_the_limit_of_texels_counts_files_alone(tmp_path: Path) -> None:
    """The file decodes to many more bytes than it has, and an array in memory does not."""
    zeros = np.zeros((3000, 4000, 1), np.uint8)
    check_texels(iter([textured(zeros).objects[0].material]), Limits(max_texels=10))
    with pytest.raises(SceneError, match="the textures have 12,000,000 pixels"):
        check_texels(iter([textured(saved(tmp_path / "t.png", zeros)).objects[0].material]), Limits(max_texels=10))


def test_a_texture_is_freed_with_its_picture() -> None:
    with Renderer() as renderer:
        # No other test uses these pixels, so no cache of another renderer holds them.
        scene, other = textured(CODES[:2]), textured(CODES[:3])
        renderer.render(scene)
        alive = weakref.ref(scene.objects[0].material.kd.texture)
        textures = renderer.resources._textures
        before = textures.size
        # The renderer's cache of prepared scenes holds the last scenes.
        renderer._prepared.clear()
        del scene
        renderer.render(other)
        gc.collect()
        assert alive() is None
        assert len(textures) == 1
        assert textures.size > before > 0
