"""Textures: their orientation, decoding, filtering and wrapping, normal maps and alpha, checked pixel by pixel."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest

from glshade import Image, Mesh, Texture
from glshade.gl.preparation import ApproximateWarning
from glshade.textures.mipmap import levels

CORNERS = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], dtype=float)
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])
FRONT: dict[str, Any] = {"type": "orthographic", "eye": [0, 0, 5], "target": [0, 0, 0], "height": 2}
SKY = [{"type": "ambient"}]
SUN = [{"type": "directional", "direction": [0, 0, -1]}]
ROUNDING = 1e-6


def square(low: float = 0.0, high: float = 1.0, z: float = 0.0, **material: Any) -> dict[str, Any]:
    """Returns a square that fills the picture. low, high: u and v at its lower left and upper right corner."""
    uvs = np.array([[low, low], [high, low], [high, high], [low, high]])
    mesh = Mesh.build(CORNERS + np.array([0, 0, z]), TRIANGLES, uvs=uvs)
    return {"mesh": mesh, "material": {"brdf": "lambert", **material}}


@pytest.fixture
def picture(tmp_path: Path) -> Any:
    """A function that saves linear values without loss, with row 0 at the top, and returns the path of the file."""

    def save(pixels: Any, name: str = "t.exr") -> Path:
        pixels = np.asarray(pixels, dtype=np.float32)
        Image(np.repeat(pixels[..., None], 3, axis=2) if pixels.ndim == 2 else pixels).save(tmp_path / name)
        return tmp_path / name

    return save


# A picture of 4 x 4 different values.
TEXELS = np.arange(16, dtype=np.float32).reshape(4, 4) / 16


@pytest.mark.parametrize("rate", ["phong", "gouraud", "flat"])
def test_a_texture_is_the_right_way_up(rate: str, draw: Any, picture: Any) -> None:
    pixels = draw(square(kd={"texture": picture(TEXELS)}), SKY, (4, 4), camera=FRONT, shading=rate)[..., 0]
    if rate == "phong":
        assert pixels == pytest.approx(TEXELS, abs=ROUNDING)
    else:
        assert pixels.max() > 0


def test_the_factor_multiplies(draw: Any, picture: Any) -> None:
    kd = {"texture": picture(TEXELS), "factor": [0.5, 1, 0]}
    pixels = draw(square(kd=kd), SKY, (4, 4), camera=FRONT)
    assert pixels == pytest.approx(TEXELS[..., None] * [0.5, 1, 0], abs=ROUNDING)


def test_8_bit_files_are_decoded(draw: Any, tmp_path: Path) -> None:
    Image(np.full((2, 2, 3), [188, 0, 255], dtype=np.uint8)).save(tmp_path / "t.png")
    for encoding, red in (("auto", 0.5029), ("srgb", 0.5029), ("linear", 188 / 255)):
        pixels = draw(square(kd={"texture": tmp_path / "t.png", "encoding": encoding}), SKY, camera=FRONT)
        # A driver may decode sRGB codes with an error of half a code, which is 2.8e-3 at this code.
        allowed = 1e-6 if encoding == "linear" else 2.8e-3
        assert pixels == pytest.approx(np.broadcast_to([red, 0, 1], (32, 32, 3)), abs=allowed), encoding


def test_filtering_is_done_in_linear_light(draw: Any, tmp_path: Path) -> None:
    """Halfway between black and white is half as bright as white."""
    Image(np.array([[[0] * 3, [255] * 3]], dtype=np.uint8)).save(tmp_path / "t.png")
    pixels = draw(square(kd={"texture": tmp_path / "t.png", "wrap": "clamp"}), SKY, (33, 33), camera=FRONT)[16, :, 0]
    assert pixels[16] == pytest.approx(0.5, abs=4e-3)
    assert np.all(np.diff(pixels) >= 0)
    assert (pixels[0], pixels[-1]) == (0, 1)


@pytest.mark.parametrize("u", ["repeat", "clamp", "mirror"])
@pytest.mark.parametrize("v", ["repeat", "clamp", "mirror"])
def test_wrap(u: str, v: str, draw: Any, picture: Any) -> None:
    """Texture coordinates from -1 to 2 show the tile and its eight neighbours, with one pixel for each texel."""

    def tiled(texels: Any, mode: str) -> Any:
        before, after = {
            "repeat": (texels, texels),
            "mirror": (texels[::-1], texels[::-1]),
            "clamp": (texels[:1].repeat(4, axis=0), texels[-1:].repeat(4, axis=0)),
        }[mode]
        return np.concatenate([before, texels, after])

    expected = tiled(tiled(TEXELS, v).T, u).T
    pixels = draw(square(-1, 2, kd={"texture": picture(TEXELS), "wrap": [u, v]}), SKY, (12, 12), camera=FRONT)[..., 0]
    assert pixels == pytest.approx(expected, abs=2 * ROUNDING)


def test_one_wrap_mode_stands_for_two(picture: Any) -> None:
    assert Texture(texture=picture(TEXELS), wrap="mirror").wrap == ("mirror", "mirror")


@pytest.mark.parametrize("side", [256, 255, 100])
def test_a_fine_checker_is_grey_from_afar(side: int, draw: Any, picture: Any) -> None:
    checker = np.indices((side, side)).sum(axis=0) % 2
    pixels = draw(square(0, 3, kd={"texture": picture(checker)}), SKY, (8, 8), camera=FRONT)
    # A row of odd length has one more texel of one colour.
    assert pixels == pytest.approx(0.5, abs=0.5 / side + 1e-3)


@pytest.mark.parametrize("shape", [(1, 1), (7, 5), (16, 16), (1, 9), (33, 2)])
def test_every_mipmap_has_the_mean_of_the_whole(shape: tuple[int, int]) -> None:
    pixels = np.random.default_rng(0).random((*shape, 4)).astype(np.float32)
    chain = list(levels(pixels))
    assert [level.shape[:2] for level in chain] == [(max(shape[0] >> i, 1), max(shape[1] >> i, 1)) for i in range(len(chain))]
    assert chain[-1].shape == (1, 1, 4)
    for level in chain:
        assert level.mean(axis=(0, 1)) == pytest.approx(pixels.mean(axis=(0, 1)), abs=1e-5)


def test_a_number_may_be_textured(draw: Any, picture: Any) -> None:
    """The exponent is read from the red channel."""
    light = [{"type": "directional", "direction": [-0.5, 0, -1]}]
    fixed = {"brdf": "phong", "kd": 0, "ks": 1}
    textured = draw(square(**fixed, exponent={"texture": picture(np.full((2, 2), 0.5)), "factor": 16}), light, camera=FRONT)
    assert textured == pytest.approx(draw(square(**fixed, exponent=8), light, camera=FRONT), rel=1e-5)
    assert 0.01 < textured.max() < 0.9


class TestNormalMap:
    """Tangent-space normals."""

    def bumped(self, draw: Any, picture: Any, normal: Any, light: Any, uv: tuple[float, float] = (0, 1), **more: Any) -> float:
        rgb = (np.asarray(normal, dtype=float) + 1) / 2
        path = picture(np.broadcast_to(rgb, (2, 2, 3)))
        lights = [{"type": "directional", "direction": [-c for c in light]}]
        item = square(*uv, kd=1, normal_map={"texture": path, **more})
        return float(draw(item, lights, (3, 3), camera=FRONT)[1, 1, 0])

    TILT = (0.5, 0.0, math.sqrt(0.75))

    def test_a_flat_map_changes_nothing(self, draw: Any, picture: Any) -> None:
        assert self.bumped(draw, picture, (0, 0, 1), (0.6, 0, 0.8)) == pytest.approx(0.8, abs=ROUNDING)

    @pytest.mark.parametrize("axis", [0, 1])
    def test_x_is_u_and_y_is_v(self, axis: int, draw: Any, picture: Any) -> None:
        tilt = self.TILT if axis == 0 else (0.0, 0.5, math.sqrt(0.75))
        assert self.bumped(draw, picture, tilt, tilt) == pytest.approx(1, abs=ROUNDING)
        away = tuple(-c if i == axis else c for i, c in enumerate(tilt))
        assert self.bumped(draw, picture, tilt, away) == pytest.approx(0.5, abs=ROUNDING)

    def test_turned_coordinates_turn_the_normals(self, draw: Any, picture: Any) -> None:
        """u and v both run backwards, so the tangent frame is turned by 180 degrees."""
        assert self.bumped(draw, picture, self.TILT, (-0.5, 0, math.sqrt(0.75)), uv=(1, 0)) == pytest.approx(1, abs=ROUNDING)

    def test_mirrored_coordinates_mirror_the_normals(self, draw: Any, picture: Any) -> None:
        """u runs backwards but v does not, which gives a left-handed tangent frame."""
        uvs = np.array([[1, 0], [0, 0], [0, 1], [1, 1]], dtype=float)
        for normal, light in (((0.5, 0, math.sqrt(0.75)), (-0.5, 0, math.sqrt(0.75))), ((0, 0.5, math.sqrt(0.75)),) * 2):
            path = picture(np.broadcast_to((np.asarray(normal) + 1) / 2, (2, 2, 3)))
            item = {
                "mesh": Mesh.build(CORNERS, TRIANGLES, uvs=uvs),
                "material": {"brdf": "lambert", "kd": 1, "normal_map": {"texture": path}},
            }
            lights = [{"type": "directional", "direction": [-c for c in light]}]
            assert draw(item, lights, (3, 3), camera=FRONT)[1, 1, 0] == pytest.approx(1, abs=ROUNDING)

    def test_scale(self, draw: Any, picture: Any) -> None:
        assert self.bumped(draw, picture, self.TILT, (0, 0, 1), scale=0) == pytest.approx(1, abs=ROUNDING)
        steep = self.bumped(draw, picture, self.TILT, (0, 0, 1), scale=2)
        assert steep == pytest.approx(math.sqrt(0.75) / math.sqrt(0.75 + 1), abs=ROUNDING)


class TestAlpha:
    """The alpha modes mask, opaque and blend."""

    @pytest.fixture
    def half(self, tmp_path: Path) -> Path:
        """A white picture that is opaque on the left and transparent on the right."""
        pixels = np.ones((8, 8, 4), dtype=np.float32)
        pixels[:, 4:] = 0
        Image(pixels).save(tmp_path / "half.png")
        return tmp_path / "half.png"

    @pytest.mark.parametrize("rate", ["flat", "gouraud", "phong"])
    def test_a_cut_out(self, rate: str, draw: Any, half: Path) -> None:
        behind = square(z=-1, brdf="ambient", ka=[0, 0, 1])
        mask = square(kd={"texture": half}, alpha_mode="mask")
        for objects in ([mask, behind], [behind, mask]):
            pixels = draw(objects, SKY, (8, 8), camera=FRONT, shading=rate)
            assert np.all(pixels[:, :3, 1] > 0.2) or rate != "phong"
            assert np.all(pixels[:, 5:7] == [0, 0, 1])
            assert not np.any(np.all(pixels[:, :3] == [0, 0, 1], axis=2))

    def test_opaque_ignores_alpha(self, draw: Any, half: Path) -> None:
        pixels = draw(square(kd={"texture": half}), SKY, (8, 8), camera=FRONT, film={"background": [0, 0, 1]})
        assert not np.any(np.all(pixels == [0, 0, 1], axis=2))

    def test_blending_is_over_and_back_to_front(self, draw: Any) -> None:
        def pane(z: float, colour: list[float]) -> dict[str, Any]:
            return square(z=z, brdf="ambient", ka=colour, alpha=0.5, alpha_mode="blend")

        red, green = pane(1, [1, 0, 0]), pane(0, [0, 1, 0])
        for objects in ([red, green], [green, red]):
            with pytest.warns(ApproximateWarning, match="back to front"):
                pixels = draw(objects, SKY, camera=FRONT, film={"background": [0, 0, 1]})
            assert pixels == pytest.approx(np.broadcast_to([0.5, 0.25, 0.25], (32, 32, 3)), abs=ROUNDING)

    def test_blended_behind_opaque_is_hidden(self, draw: Any) -> None:
        pane = square(z=-1, brdf="ambient", ka=1, alpha=0.5, alpha_mode="blend")
        with pytest.warns(ApproximateWarning):
            pixels = draw([pane, square(brdf="ambient", ka=0.25)], SKY, camera=FRONT)
        assert pixels == pytest.approx(0.25, abs=ROUNDING)


def test_a_16_bit_file_keeps_its_digits(draw: Any, tmp_path: Path) -> None:
    path = str(tmp_path / "t.png")
    output = oiio.ImageOutput.create(path)
    output.open(path, oiio.ImageSpec(1, 1, 3, "uint16"))
    output.write_image(np.full((1, 1, 3), 32768, dtype=np.uint16))
    output.close()
    assert draw(square(kd={"texture": path, "encoding": "linear"}), SKY, camera=FRONT) == pytest.approx(
        32768 / 65535, abs=ROUNDING
    )


def test_a_texture_of_a_file_that_changes(draw: Any, picture: Any) -> None:
    """A file whose content has changed is read again."""
    path = picture(np.full((2, 2), 0.25))
    assert draw(square(kd={"texture": path}), SKY, camera=FRONT) == pytest.approx(0.25)
    picture(np.full((2, 2), 0.75))
    assert draw(square(kd={"texture": path}), SKY, camera=FRONT) == pytest.approx(0.75)
