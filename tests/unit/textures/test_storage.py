"""Storage: texels take few bytes, the codes of a picture stay exact, and mipmaps are rounded once, to the nearest code."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from glshade import Mesh, Renderer, Scene, verify
from glshade.brdfs import BRDFS
from glshade.image.srgb import linear_to_srgb, srgb_to_linear
from glshade.radiance.sampler import Sampler
from glshade.textures.mipmap import BAND, levels
from glshade.textures.pixel_array import PixelArray
from glshade.textures.storage import Normal10, Srgb8, Stored, Unorm16
from glshade.textures.texels import Texels, texels_of

SQUARE = Mesh.build(
    np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], dtype=float),
    np.array([[0, 1, 2], [0, 2, 3]]),
    uvs=np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=float),
)
FRONT = {"type": "orthographic", "eye": [0, 0, 5], "target": [0, 0, 0], "height": 2}
LIGHTS = [{"type": "ambient"}, {"type": "directional", "direction": [-0.4, 0.3, -1]}]


def pictures(*channels: int) -> Any:
    """A strategy for pictures of 8-bit codes."""
    shapes = st.tuples(st.integers(1, 9), st.integers(1, 9), st.sampled_from(channels))
    return shapes.flatmap(lambda shape: arrays(np.uint8, shape))


def scene(material: dict[str, Any], size: int = 16) -> Scene:
    thing = {"mesh": SQUARE, "material": {"brdf": "ggx", **material}}
    return Scene.model_validate({"objects": [thing], "lights": LIGHTS, "camera": FRONT, "film": {"size": [size, size]}})


def code(values: Any) -> Any:
    return np.rint(linear_to_srgb(values) * 255)


@given(pixels=pictures(1, 3, 4))
def test_colours_keep_their_codes(pixels: Any) -> None:
    (largest, *_) = Stored.of(pixels, Srgb8(pixels.shape[2]), {1: "RRR1", 3: "RGB1"}.get(pixels.shape[2], "RGBA")).decoded()
    expected = np.broadcast_to(pixels[..., :3], (*pixels.shape[:2], 3))
    np.testing.assert_array_equal(code(largest[..., :3]), expected)
    np.testing.assert_allclose(largest[..., :3], srgb_to_linear(expected / 255), rtol=1e-6)
    alpha = pixels[..., 3] / 255 if pixels.shape[2] == 4 else 1.0
    np.testing.assert_allclose(largest[..., 3], alpha, rtol=1e-6)


@given(pixels=pictures(1, 2, 4))
def test_numbers_keep_their_codes(pixels: Any) -> None:
    count = pixels.shape[2]
    (largest, *_) = Stored.of(pixels, Unorm16(count), "RGBA"[:count] + "1" * (4 - count)).decoded()
    np.testing.assert_allclose(largest[..., :count], pixels / 255, rtol=1e-6)


@given(pixels=pictures(3))
def test_normals_keep_their_directions(pixels: Any) -> None:
    (largest, *_) = Stored.of(pixels, Normal10(3), "RGB1").decoded()
    given, shown = 2 * (pixels / 255) - 1, 2 * largest[..., :3].astype(float) - 1
    np.testing.assert_allclose(shown, given * 765 / 1023, atol=1e-6)
    assert (largest[..., 3] == 1).all()


@given(pixels=pictures(1, 3, 4))
def test_each_mipmap_is_the_nearest_code_of_the_mean_in_linear_light(pixels: Any) -> None:
    """The means come from the picture itself, and not from the rounded level before."""
    count = pixels.shape[2]
    linear = srgb_to_linear(pixels / 255)
    if count == 4:
        linear[..., 3] = pixels[..., 3] / 255
    stored = Stored.of(pixels, Srgb8(count), "RGBA")
    assert len(stored.levels) == len(list(levels(linear)))
    for level, mean in zip(stored.levels[1:], list(levels(linear))[1:], strict=True):
        assert level.shape == mean.shape
        exact = linear_to_srgb(mean).astype(float) * 255
        if count == 4:
            exact[..., 3] = mean[..., 3] * 255
        # A thirtieth of a code is left to the table that encodes.
        assert np.abs(level - exact).max() <= 0.5 + 1 / 30


@pytest.mark.parametrize("shape", [(2 * BAND + 2, 7), (2 * BAND + 1, 6), (1, 5), (5, 1)])
def test_bands_of_rows_give_the_levels_of_the_whole(shape: tuple[int, int]) -> None:
    pixels = np.random.default_rng(0).integers(0, 256, (*shape, 2), dtype=np.uint8)
    stored = Stored.of(pixels, Unorm16(2), "RG01")
    for level, mean in zip(stored.levels, levels(pixels.astype(np.float32)), strict=True):
        assert np.abs(level / 257 - mean).max() <= 0.5 / 257 + 1e-4


MATERIALS: dict[str, tuple[dict[str, Any], str, float]] = {
    "a colour": ({"kd": {"texture": 3}}, "SRGB8_ALPHA8", 4),
    "a grey colour": ({"kd": {"texture": 1}}, "SRGB8_ALPHA8", 4),
    "a colour with alpha": ({"kd": {"texture": 4}}, "SRGB8_ALPHA8", 4),
    "a number": ({"roughness": {"texture": 3, "channel": "g"}}, "R16", 2),
    "a direction": ({"tangent_direction": {"texture": 3}, "anisotropy": 0.5}, "RG16", 4),
    "a normal": ({"normal_map": {"texture": 3}}, "RGB10_A2", 4),
    "heights": ({"bump_map": {"texture": 1}}, "RG32F", 8),
    "linear colours": ({"kd": {"texture": 3, "encoding": "linear"}}, "RGBA16", 8),
}


@pytest.mark.parametrize("name", MATERIALS)
def test_a_texture_takes_few_bytes_and_is_verified(name: str, renderer: Renderer) -> None:
    keys, form, size = MATERIALS[name]
    random = np.random.default_rng(1)

    def filled(value: Any) -> Any:
        if not isinstance(value, dict):
            return value
        # Squares of four texels are magnified and of one texel minified, in a picture of 16 pixels.
        return {**value, "texture": random.integers(0, 256, (32, 8, value["texture"]), dtype=np.uint8)}

    shown = scene({key: filled(value) for key, value in keys.items()})
    material = shown.objects[0].material
    (picture,) = (key for key in keys if isinstance(keys[key], dict))
    texels = texels_of(material, picture)
    assert texels.read().format.name == form
    renderer.render(shown)
    texture = renderer.resources.texture(texels)
    # The mipmaps add a third, and a little more for a picture that is not square.
    assert size * 32 * 8 < texture.extra <= size * 32 * 8 * 1.4
    result = verify(shown, renderer=renderer)
    assert result.unexplained == 0
    assert result.verdict == "verified"


def test_parameters_that_read_one_picture_share_its_texture() -> None:
    pixels = np.random.default_rng(0).integers(0, 256, (4, 4, 3), dtype=np.uint8)
    keys = {"roughness": {"texture": pixels, "channel": "g"}, "metallic": {"texture": pixels, "channel": "b"}}
    material = BRDFS["ggx"].model_validate({"brdf": "ggx", **keys})
    first, second = (texels_of(material, name) for name in keys)
    assert first == second
    assert first.read().format.name == "RG16"
    (largest, *_) = first.read().decoded()
    np.testing.assert_allclose(largest[..., 1:3], pixels[::-1, :, 1:] / 255, rtol=1e-6)
    alone = material.model_copy(update={"metallic": 0.0})
    assert texels_of(alone, "roughness") != first


def test_a_cut_out_keeps_the_codes_of_alpha(renderer: Renderer) -> None:
    """A texel is drawn from the very code of the cutoff on."""
    pixels = np.full((2, 2, 4), 255, dtype=np.uint8)
    pixels[..., 3] = [[127, 128], [129, 0]]
    keys = {"kd": {"texture": pixels, "filter": "nearest"}, "alpha_mode": "mask", "alpha_cutoff": 128 / 255}
    picture = renderer.render(scene(keys, 2), dtype="float32").pixels
    np.testing.assert_array_equal(picture[..., 0] > 0, [[False, True], [True, False]])


def test_colours_are_read_as_the_driver_decodes_them() -> None:
    codes = np.arange(256, dtype=np.uint8).reshape(16, 16, 1)
    sampler = Sampler.load(Texels(PixelArray.of(codes), ("repeat", "repeat"), "auto"))
    driver = sampler.decoded(np.linspace(0, 1, 256), 0.3)
    np.testing.assert_allclose(driver.texels[:256, 0], codes[::-1].reshape(-1) / 255, rtol=1e-6)
    np.testing.assert_array_equal(driver.texels[:, 3], 1)
    darker, brighter = sampler.decoded((), 0.3).extremes
    for end, error in ((darker, -0.3), (brighter, 0.3)):
        inside = (sampler.codes[:, 0] > 0) & (sampler.codes[:, 0] < 255)  # type: ignore[index]
        moved = linear_to_srgb(end.texels[inside, 0]).astype(float) * 255 - sampler.codes[inside, 0]  # type: ignore[index]
        np.testing.assert_allclose(moved, error, atol=2e-3)


def test_a_picture_of_an_unknown_driver_may_be_off_by_half_a_code(renderer: Renderer) -> None:
    shown = scene({"kd": {"texture": np.full((2, 2, 3), 60, dtype=np.uint8)}})

    def picture(by: float) -> Any:
        value = srgb_to_linear(np.array((60 + by) / 255)).item()
        return renderer.render(scene({"kd": [value] * 3}), dtype="float32").pixels

    assert verify(shown, picture=picture(0.4)).unexplained == 0
    assert verify(shown, picture=picture(1.5)).unexplained > 0


def saved(path: Path, pixels: Any) -> Path:
    """Writes an 8-bit PNG file (H, W, 3) byte by byte."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    height, width, _ = pixels.shape
    rows = b"".join(b"\0" + row.tobytes() for row in pixels)
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))
    return path


def test_a_file_of_8_bits_is_stored_like_an_array(tmp_path: Path) -> None:
    pixels = np.random.default_rng(2).integers(0, 256, (5, 3, 3), dtype=np.uint8)
    of_file, of_array = (
        Texels(source, ("repeat", "repeat"), "auto").read()
        for source in (saved(tmp_path / "t.png", pixels), PixelArray.of(pixels))
    )
    assert of_file.format.name == of_array.format.name == "SRGB8_ALPHA8"
    for left, right in zip(of_file.levels, of_array.levels, strict=True):
        np.testing.assert_array_equal(left, right)
